"""The words under which lab files name quantities, qualify them, or say that a column is no record, in many languages."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType


def _set(text: str) -> frozenset[str]:
    return frozenset(text.split())


def _stems(text: str) -> tuple[str, ...]:
    return tuple(text.split())


#: Quantity -> names in lower case, in order of preference where a file has several. Underscores and spaces are the same. The
#: raw force comes before a corrected one: the model has the load zero as a parameter, and must see what the cell read.
NAMES: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        quantity: tuple(name.strip() for name in " | ".join(lines).split("|"))
        for quantity, lines in {
            "time": (
                "time | total time | running time | elapsed time | time elapsed | test time | relative time | timestamp",
                "time stamp | measurement time | elapsed | time since start | unix time | unix timestamp | epoch",
                "epoch time | posix time | pc time | log time | datetime | date time | date/time | millis | micros | ts",
                "seconds | t | zeit | prüfzeit | laufzeit | testzeit | messzeit | uhrzeit | zeitstempel | zeitpunkt",
                "datum uhrzeit | temps | temps écoulé | temps ecoule | temps d'essai | durée | duree | horodatage | heure",
                "tiempo | tiempo transcurrido | tempo | tempo trascorso | tempo decorrido | tijd | verstreken tijd",
                "meettijd | czas | czas próby | czas badania | godzina | čas | tid | süre",
                "zaman | aika | idő | mérési idő | vreme | vrijeme | timp | laikas | χρόνος | χρονος | час | 测试时间",
                "время | 时间 | 時間 | 试验时间",
                "clock | 試験時間 | 経過時間 | 測定時間 | 時刻 | 日時 | 測定日時 | 시간 | 경과시간 | 시험시간",
                "cycle elapsed time | run time | last changed | last updated | tm",
                "thời gian | waktu | الزمن | الوقت | समय | време | เวลา | زمان | זמן",
            ),
            "displacement": (
                "extension | displacement | compressive extension | compressive displacement | crosshead",
                "crosshead displacement | crosshead position | crosshead travel | crosshead extension | axial displacement",
                "digital position | compression | indentation | indentation depth | depth | z position | position",
                "position z | z displacement | displacement z | travel | standard travel | stroke | axial position",
                "distance | deflection | deformation | disp | penetration | penetration depth | compression distance | h",
                "s | indenter displacement | stage position | piezo displacement | piezo extension | z stage | z height | z",
                "d | standardweg | traversenweg | weg | istweg | verschiebung | verformung | eindringtiefe | maschinenweg",
                "istposition | ram position | ram displacement | verlängerung | verlaengerung | längenänderung",
                "stauchung | hub | kolbenweg | stempelweg | prüfweg | auslenkung | eindrückung | déplacement | deplacement",
                "traverse | déplacement traverse | déplacement de la traverse | enfoncement | course | allongement",
                "écrasement | ecrasement | profondeur | profondeur de pénétration | flèche | desplazamiento | extensión",
                "posición | recorrido | deformación | alargamiento | carrera | profundidad | spostamento",
                "spostamento traversa | corsa | corsa traversa | posizione | allungamento | deformazione | schiacciamento",
                "profondità | deslocamento | deslocação | extensão | posição | deformação | curso | profundidade",
                "verplaatsing | indrukking | indringdiepte | positie | afstand | uitrekking | slag | traverseweg",
                "przemieszczenie | przesunięcie | przesuniecie | droga | wydłużenie | wydluzenie | ugięcie | ugiecie",
                "zagłębienie | zaglebienie | wgłębienie | głębokość | glebokosc | skrócenie | skrocenie | piezo | piezo z",
                "position vérin | position verin | course vérin | course verin | déplacement vérin | deplacement verin",
                "położenie | polozenie | pozycja | przemieszczenie trawersy | skok | posunutí | posuv | dráha",
                "förskjutning | väg | sträcka | deformation | hoptryckning | vej | vejlængde | forskydning | sammentrykning",
                "vei",
                "forskyvning | siirtymä | puristuma | matka | asema | painuma | elmozdulás | elmozdulas | út | benyomódás",
                "összenyomódás | yer değiştirme | yerdeğiştirme | deplasman | uzama | sıkışma | yol | batma | poloha",
                "deformace",
                "stlačení | posunutie | pomik | pomak | deplasare | μετατόπιση | μετατοπιση | διαδρομή | διαδρομη | θέση",
                "βύθιση",
                "переміщення | indringing | percurso | deslocamento axial | 行程 | 壓縮量 | 押込み量 | 압입깊이",
                "перемещение | деформация",
                "ход | глубина | 位移 | 横梁位移 | 橫樑位移 | 變形",
                "变形 | 压缩位移 | 压缩量 | 変位 | ストローク",
                "压入深度 | 压痕深度 | 压入量 | 压下量 | 位移量 | 变形量 | 压头位移 | 壓入深度",
                "押込み深さ | 押し込み深さ | 押込深さ",
                "変位量 | 伸び | 圧縮変位 | 변위 | 이동거리 | 거리 | 위치 | 신장 | 신율",
                "스트로크 | 압축변위 | 압축량 | 크로스헤드 변위 | traversenweg absolut | pos | axis | achse",
                "axe | δ | 实际位移 | 実変位 | 現在位置 | 当前位置 | extension from preload | deflection from preload",
                "gap | spalt | messspalt | entrefer | displ | displac | zpos | zposition | zdisp | zdisplacement",
                "lvdt | dvrt | extensometer | laser | encoder | linear encoder | cod | clip gauge | clip gage | dial gauge",
                "dial gage | linear scale | glass scale | interferometer | vibrometer | potentiometer | linear potentiometer",
                "wegaufnehmer | wegsensor | messuhr | messtaster | feintaster | tastweg | extensomètre | extensometre",
                "extensómetro | estensometro | 引伸计 | 伸び計 | 신율계",
                "elongation | élongation | độ dịch chuyển | dịch chuyển | chuyển vị | perpindahan | الإزاحة | विस्थापन",
                "преместване | desplaçament | vandring | posun | hod | pomeraj | cursă | ход траверсы | перемещение траверсы",
                "stage | stage z | dist | depl | dep | dépl | despl | desp | spost | verpl | przem",
                "ausdehnung | kompressive ausdehnung | druckausdehnung | kompressionsausdehnung | kompressionsweg | druckweg",
                "kompressive verschiebung | extension en compression | extension de compression | extension compressive",
                "déplacement en compression | déplacement de compression | déplacement compressif",
                "allongement en compression | extensión en compresión | extensión de compresión | extensión por compresión",
                "extensión compresiva | desplazamiento compresivo | desplazamiento de compresión",
                "desplazamiento en compresión | desplazamiento por compresión | estensione | estensione compressiva",
                "estensione a compressione | estensione di compressione | estensione in compressione",
                "spostamento compressivo | spostamento di compressione | spostamento a compressione | extensie",
                "compressieve extensie | compressie-extensie | drukverplaatsing | extensão compressiva",
                "extensão de compressão | extensão por compressão | deslocamento compressivo | deslocamento de compressão",
                "wydłużenie ściskające | przemieszczenie ściskające | 压缩扩展 | 压缩伸长 | 压缩延伸 | 壓縮位移 | 壓縮伸長",
                "圧縮伸び | 圧縮伸長 | 압축신장 | 압축 변위 | 압축 신장",
                "ระยะ | ระยะกด | การกระจัด",
                "جابجایی | جابه‌جایی | تغییر مکان | תזוזה | העתקה",
            ),
            "force": (
                "load | force | compressive load | compressive force | raw force | raw load | normal force | axial force",
                "axial load | standard force | fz | z force | force z | fn | contact force | indentation force",
                "indentation load | f | p | standardkraft | kraft | istkraft | prüfkraft | last | druckkraft | normalkraft",
                "axialkraft | presskraft | charge | effort | force de compression | effort normal | force normale",
                "force standard | charge de compression | fuerza | carga | fuerza de compresión | fuerza normal | forza",
                "carico | forza normale | forza di compressione | força | forca | força normal | kracht | belasting",
                "drukkracht | siła | sila | siła ściskająca | siła normalna | siła standardowa | obciążenie | obciazenie",
                "nacisk | síla | zatížení | kuvvet | yük | нагрузка | сила | усилие | 载荷 | 荷载",
                "负荷 | 力 | 压力值 | 压缩力 | 力值",
                "试验力 | 試験力 | 荷重 | 圧縮荷重 | 하중 | 힘 | 시험력 | 부하",
                "voima | kuorma | puristusvoima | erő | nyomóerő | terhelés | baskı kuvveti | tryckkraft | belastning",
                "forță | forta | sila tlaku | tlaková síla | zaťaženie | δύναμη | δυναμη | φορτίο | φορτιο | навантаження",
                "força axial | normaalkracht | 力量 | 負荷 | 負載 | 載重 | 荷載 | 圧縮力 | 押込み荷重 | 압축하중 | 압축력",
                "zforce | corrected force | corrected load | kraftmessdose | kraftaufnehmer | kraftsensor | capteur de force",
                "célula de carga | cella di carico | dynamometer | weight | gewicht | gewichtskraft | poids | peso | mass",
                "masse | 重量 | 무게 | balance | scale | scales | waage | bilancia | balanza | báscula | balança | waga | våg",
                "天平 | 저울",
                "loadcell | lực | tải trọng | gaya | beban | القوة | बल | càrrega | натоварване | forţă | sarcină",
                "opterećenje | 压力 | 壓力 | แรง | نیرو | כוח | fza | fuer | frz | push",
                "reaction force | force reaction | reaktionskraft | force de réaction | fuerza de reacción | forza di reazione",
            ),
            "capacitance": (
                "cp | parallel capacitance | cpar | cap parallel | parallelkapazität | capacité parallèle | capacitance",
                "cap cp | capacitance cp | c cp | cp ab | c parallel | c par | capacitance parallel | parallel cap",
                "parallel c | 并联电容 | 並聯電容 | 並列容量",
                "cap | c | kap | kapazität | kapazitaet | capacité | capacite | capacitancia | capacidad | capacità",
                "capacitância | capacidade | capaciteit | pojemność | pojemnosc | kapacita | kapacitans | kapasitanssi",
                "kapasitans | kapacitás | sığa | capacitate | χωρητικότητα | ёмкость | емкость",
                "电容 | 电容值 | 静電容量 | 電容 | 정전용량 | 커패시턴스 | 용량",
                "capa | capac | kapaz | 容量 | 容量値 | ความจุ | ความจุไฟฟ้า | ظرفیت | ظرفیت خازنی | קיבול",
                "điện dung | kapasitansi | السعة | धारिता | капацитет | capacitat | kapacitet | kapacitivnost",
            ),
            "capacitance_series": (
                "cs | series capacitance | cser | cap series | capacitance series | cap cs | capacitance cs",
                "c cs | cs ab | c series | c ser | series cap | series c | reihenkapazität | serienkapazität",
                "capacité série | pojemność szeregowa | 串联电容 | 串聯電容 | 直列容量",
            ),
            "dissipation": (
                "d | dissipation | dissipation factor | d factor | d value",
                "df | loss tangent | loss factor | tan delta | tan d | tan δ | tanδ",
                "tandelta | tgδ | tg δ | tan(δ) | verlustfaktor | tangente de pertes | facteur de pertes",
                "factor de disipación | fattore di dissipazione | fator de dissipação | verliesfactor | współczynnik strat",
                "tangens strat | 损耗 | 損失係数 | 损耗因子 | 손실계수",
            ),
            "quality": ("q | quality factor | q factor | güte | gütefaktor | 品质因数",),
            "frequency": (
                "frequency | freq | f | measurement frequency | test frequency | frequenz | messfrequenz | fréquence",
                "frequence | frecuencia | frequenza | frequência | frequentie | częstotliwość | czestotliwosc | 频率 | 周波数",
                "주파수",
            ),
            "cycle": (
                "total cycle count | cycle count | cycle | total cycles | elapsed cycles | cycles | axial count",
                "cycle number | zyklus | zyklen | ciclo | ciclos | cykl | 循环 | サイクル | 사이클",
            ),
            "status": ("status | stat | lcr status | measurement status | ステータス | 状态 | 상태",),
        }.items()
    }
)

#: Names of instruments and of other things than readings, which are one of a quantity by its unit alone.
ONLY_WITH_UNIT = frozenset(
    name.strip()
    for names in (
        "s | clock | tm | h | p | δ | lvdt | dvrt | extensometer | laser | encoder | linear encoder | cod | clip gauge",
        "clip gage | dial gauge | dial gage | linear scale | glass scale | interferometer | vibrometer",
        "potentiometer | linear potentiometer | wegaufnehmer | wegsensor | messuhr | messtaster | feintaster",
        "tastweg | extensomètre | extensometre | extensómetro | estensometro | 引伸计 | 伸び計 | 신율계 | kraftmessdose",
        "kraftaufnehmer | kraftsensor | capteur de force | célula de carga | cella di carico | dynamometer",
        "weight | gewicht | gewichtskraft | poids | peso | mass | masse | 重量 | 무게 | stage | stage z | hod",
        "balance | scale | scales | waage | bilancia | balanza | báscula | balança | waga | våg | 天平 | 저울",
        "loadcell | beban | 压力 | 壓力 | dist | dep | desp | fza | fuer | frz | push | 容量 | ระยะ",
    )
    for name in names.split("|")
)
#: Names of a mass and of what weighs it, that of a sample where it stands still.
MASSES = _set(
    "weight gewicht poids peso mass masse 重量 무게 balance scale scales waage bilancia balanza báscula balança waga våg 天平 "
    "저울"
)
#: Words beside a name that leave it what it is: `Primary load measurement`, `Tensile Force`.
QUALIFIERS = _set(
    "primary main normal measured measurement meas measure tensile compressive compression tension applied actual act "
    "current present static reading readings value values val signal sensor cell machine instron axial vertical live "
    "instantaneous data instant raw digital linear analog test sample specimen frame total device meter ist messwert "
    "istwert gemessene gemessen gemessenes gemessener feedback lcr daq tester cellule capteur mesurée mesuré mesure "
    "misurata misurato medida medido zmierzona zmierzone zmierzony gemeten indenter gross brutto ax vert compr "
    "experimental experimentell experimentelle expérimental expérimentale sperimentale expt real réel réelle reale "
    "effettivo effettiva werkelijk werkelijke rzeczywista rzeczywiste rzeczywisty kompressive kompressiver kompressives "
    "uncorrected unkorrigiert uncompensated unkompensiert unfiltered ungefiltert roh rohwert rohwerte brute brut bruta "
    "bruto cruda crudo grezza grezzo"
)
#: Words that say that a column was worked on after the measurement: read only where no other column is.
PROCESSED = _set(
    "corrected filtered smoothed smooth tared zeroed balanced compensated adjusted lowpass gefiltert korrigiert geglättet "
    "tariert corrigé filtré subtracted removed net netto corr korr comp corrigée filtrée compensé compensée korrigierte "
    "kompensiert kompensierte gefilterte geglättete corregido corregida corrigido corrigida compensado compensada corretto "
    "corretta compensato compensata filtrado filtrada filtrato filtrata gecorrigeerd gecompenseerd skorygowana skorygowany "
    "driftkorrigiert driftbereinigt offsetkorrigiert nullpunktkorrigiert basislinienkorrigiert tiefpassgefiltert "
    "mediangefiltert temperaturkompensiert lissé lissée suavizado suavizada"
)
#: Words of these by which readings have another level or scale, not another zero or less noise alone.
CORRECTED = _set(
    "corrected compensated adjusted korrigiert corrigé subtracted removed net netto corr korr comp corrigée compensé compensée "
    "korrigierte kompensiert kompensierte corregido corregida corrigido corrigida compensado compensada corretto corretta "
    "compensato compensata gecorrigeerd gecompenseerd skorygowana skorygowany"
)
#: Words of what was computed from a measurement, or is a part of one: no record unless the user says so.
DERIVED = _set(
    "fitted fit interpolated normalized normalised scaled computed calculated calc estimated model modelled modeled "
    "predicted simulated theory theoretical error residual delta change diff difference offset baseline bias stray "
    "parasitic open short berechnet drift dérive deriva"
)
#: Words beside a name that is not understood that say that its readings are more, less or others than were measured.
ALTERED = _set(
    "minus less plus above beyond excess increase gain growth rise times half halved double doubled twofold twice thrice "
    "triple tripled two both before after ref ten tens dozen dozens percent mille hundreds thousands hundred thousand "
    "tenth tenths hundredth hundredths thousandth thousandths amplified attenuated uncal uncalibrated dummy previous "
    "remaining per abzüglich zuzüglich avant après antes después halbiert verdoppelt zweifach doppelt verstärkt "
    "unkalibriert vorher rest je zehntel hundertstel tausendstel moins double moitié dixièmes centièmes menos doble mitad "
    "décimas centésimas meno doppio metà decimi centesimi step steps lag trip rated safe hertz hertzian fem fea"
)
#: How words begin of what is left to be done, or was at another time: `Remaining travel`, `Force précédente`.
NOT_NOW = _stems(
    "remaining remainder previous preceding verbleibend restlich vorherig vorangegangen restant précédent precedent anterior "
    "rimanent resterend vorige voorgaand pozostał poprzedni zbývaj předchoz återstående föregående оставш предыдущ 剩余 剩餘 "
    "上次 前回 残り 남은 이전"
)
#: What is left of it may be one word with "rest": `Restweg`, `Restzeit`.
WITH_REST = _set("weg hub zeit strecke distanz abstand dauer verfahrweg fahrweg kraft last")
#: Words that say so beside the name of a quantity or of a run: `Old force`, `Cp prev`, `Displacement last run`.
OTHER_ONE = _set(
    "last prev next old earlier letzte letzter letztes letzten nächste nächster nächstes alte alter altes dernier dernière "
    "suivant suivante ancien ancienne último última ultimo ultima próximo próxima prossimo prossima first erste erster erstes "
    "premier première primer primera prima primo eerste alt vieux vieille viejo vieja vecchio vecchia velho velha oud oude"
)
RUNS = _set(
    "run cycle test trial press measurement step value reading sample specimen versuch versuchs zyklus messung prüfung lauf "
    "schritt wert essai mesure valeur ciclo ensayo medida medición valor prova misura valore"
)
#: Words of a difference from something: of a capacitance, whose level matters, no record; a force or a place has a zero anyway.
RELATIVE = _set("rel relative relativ offset tared zeroed nulled removed subtracted baseline balanced")
#: Words of a name whose column counts the phases of one record.
PHASES = _set(
    "step segment phase stage state cycle block branch direction ramp loop event action schritt abschnitt phasen étape paso "
    "fase etap mode status used cycles cyc zyklus zyklen cykl cyklus cyclus ciclo ciclos цикл lastspiel lastspiele lap "
    "этап шаг 循环 周期 步骤 サイクル 사이클"
)
#: Words of what was commanded or allowed, not measured.
COMMANDED = _set(
    "setpoint set setpt sp command commanded cmd target demand demanded desired limit limits threshold reference nominal "
    "nominale nominell nominelle nominaal nominales limite límite limites limiet "
    "programmed preset goal trigger soll sollwert vorgabe sollkraft sollweg zielwert consigne consignes setpunt obiettivo "
    "zadana zadany zadane zadaná consigna impostata gewenst riferimento referencia referência référence referentie comando "
    "comandada comandado commande alvo visée 设定 设定值 目标 目標 指令 給定 给定 設定 설정 목표 지령"
)
#: How words begin, and how they end, that are joined from one of these and others, or are a form of one: `Sollposition`.
COMMANDED_BEGINNINGS = _stems(
    "nenn grenz "
    "soll ziel vorgabe führungsgr fuehrungsgr stellgr setpoint target commanded demand consign cible zadan docelow zadávan "
    "žádan požadovan nastaven impostat desejad desead objetiv obiettiv richiest prescrit gewenst streef doelw börvärd målvärd "
    "ønsket asetus tavoite hedef célért előírt prescris уставк задани заданн целев требуем"
)
COMMANDED_ENDINGS = _stems(
    "vorgabe sollwert sollwerte soll zielwert ziel setpoint setpt target consigne börvärde grenzwert grenze nennwert"
)
#: Words of those that say how far readings may go, which a flag of the rows that did may bear, too.
BOUNDS = _set("limit limits threshold limite límite limites limiet grenze grenzwert")
#: Words of the largest of several readings, which a peak of a record may bear, too.
_PEAKS = _set(
    "fmax fmin cmax cmin pk pico picco pic crête crete piek spitzenkraft spitzenlast spitzenweg höchstkraft höchstlast "
    "maximalkraft maximallast bruchkraft bruchlast break rupture ultimate amplitude amplituden amplitud ampiezza amplituda "
    "máx máxima máximo massima maxima maxim 峰值 ピーク 피크"
)
_NUMBERS_DRAWN = _set(
    "max maximum min minimum mean average avg averaged peak peaks valley std stdev sd stddev deviation variance var "
    "median rms range hold p-p pk-pk pp statistic statistics maximal maximale maximaler höchst mittel mittelwert moyenne "
    "moyen maxi mini massimo minimo media promedio médio średnia maks gemiddelde spitze spitzenwert scheitel scheitelwert "
    "最大 最小 平均 최대 최소 평균 largest highest greatest biggest smallest lowest größter größte größtes größten "
    "größtwert grösster grösste grösstes grösstwert höchster höchste höchstes höchsten höchstwert kleinster kleinste "
    "kleinstes kleinsten kleinstwert niedrigster niedrigste niedrigstes tiefster tiefste tiefstwert mayor menor maggiore "
    "minore grootste hoogste kleinste laagste największa największy najmniejsza najmniejszy största högsta minsta lägsta"
)
#: Words of the mean of several readings, and of how far these are from it.
MEANS = _set(
    "mean average avg ave averaged mittel mittelwert gemittelt gemittelte moyenne moyen moyenné moyennée media promedio "
    "promediado médio średnia uśredniona gemiddelde 平均 평균"
)
SPREADS = _set("std stdev sd stddev deviation variance var sem stderr rms standardabweichung stabw abw écart-type 标准差")
#: Words of the smallest and of the largest of several readings.
LEAST = _set(
    "min minimum minimal mini minimo mínimo mín 最小 최소 smallest lowest kleinster kleinste kleinstes niedrigste menor minore"
)
MOST = _set(
    "max maximum maximal maxi massimo máximo máx maks 最大 최대 largest highest greatest biggest größter größte größtes "
    "höchste höchster höchstes mayor maggiore"
)
#: Words that alone say that a column was measured, where another was commanded.
MEASURED = _set(
    "measured meas actual act ist istwert messwert gemessen gemessene feedback real mesuré mesurée mesure réel réelle medido "
    "medida misurato misurata effettivo zmierzona zmierzone zmierzony gemeten werkelijk 实际 実際 실제 reading value pv "
    "process fbk fb fdbk rückmeldung retroazione 反馈 反饋 フィードバック 피드백"
)
#: Words of a number drawn from several readings.
STATISTIC = _NUMBERS_DRAWN | _PEAKS | MEANS | SPREADS
#: Words of which one in a cell makes its row one of results, no reading.
RESULTS = _NUMBERS_DRAWN - _set("scheitelwert hold peak peaks valley range pp p-p pk-pk spitze scheitel") | _set(
    "total sum summe cov cv rsd deviation standardabweichung standardabw abw stabw écart-type desviación odchylenie 标准差 合计"
)
#: Words in brackets that say where or how a column was measured, and change nothing.
REMARKS = QUALIFIERS | _set(
    "absolute abs absolut relative rel relativ druck loadcell lvdt encoder crosshead top upper bottom lower channel ch z cp "
    "parallel axis down up calibrated auto medium slow fast"
)
#: What measures a place, and may stand beside it in a name: `displacement crosshead`, `LVDT displacement`.
SENSORS = _set("crosshead lvdt dvrt extensometer encoder laser traverse")
#: What presses, and what moves it and gives way itself, as they begin words of a name: `Ball travel`, `Kugelweg`, `Stage z`.
PRESSING = _set(
    "ball kugel bille bola sfera kulka probe indenter indentor tip tool punch sphere plunger eindring stempel 球 压头 圧子 압자"
)
MOVING = _set(
    "stage stroke crosshead traverse traversen ram piston kolben actuator aktor aktuator motor machine maschine maschinen hub "
    "course vérin"
)
#: Words before the number of a channel of an amplifier or a board: `ch1`, `AI 1`.
CHANNELS = _set("ch chan channel kanal canal canale kanaal kanał ai ain adc input eingang param demod 通道 채널")
#: Who makes load cells, displacement sensors and meters: `Kistler 9207 [N]`.
MAKERS = _set(
    "kistler hbm hbk burster futek lorenz schunk ati zemic kyowa tml vishay tedea revere sauter imada shimpo keyence wenglor "
    "baumer sick heidenhain sylvac mitutoyo micro-epsilon microepsilon solartron rdp novotechnik polytec renishaw "
    "magnescale omron panasonic keysight agilent hioki wayne-kerr gwinstek instron zwick zwickroell shimadzu mecmesin"
)
#: Words that stand before a number of something else than an instrument: a specimen, a gain, a filter, a version.
NUMBERED_OTHERWISE = _set(
    "at av ma sg lp hp bp gain amp mult div factor fac scale zoom ref zero tare tara sim fem fea poly model eq pred exp "
    "old new ver rev copy day week cyc rep batch lot ball seg pass press side sp pv mv no nr id hz khz off corr norm log "
    "ln rate dt top left right upper lower pos temp ratio resid ld ul up down"
)
#: Names of a time that begins anew with each step of a test, and is one of the record where it holds one step.
STEP_TIMES = frozenset(["step time", "segment time", "time in step", "schrittzeit", "zeit im schritt", "abschnittszeit"])
#: Words of a second instrument of a kind, beside the one that is meant where nothing else is said.
SECOND = _set("aux auxiliary second secondary 2nd backup spare other external ext zweite zweiter")
#: Words that name a column whose values part a long table into several records.
KEYS = _set(
    "channel chan ch kanal canal canale kanaal kanał sensor sensore capteur sensors specimen sample prüfling probe "
    "probekörper éprouvette échantillon probeta muestra provino campione próbka run trial test device dut port mux "
    "electrode elektrode électrode pad taxel pixel cell unit replicate repeat experiment indent indentation site location "
    "punkt messpunkt point freq frequency frequenz fréquence frecuencia frequenza częstotliwość 频率 周波数 주파수 "
    "通道 传感器 试样 チャンネル センサ 試料 채널 센서 시편"
)
#: Words that do so where the values change from row to row, and stand in turn.
KEYS_IN_TURN = _set(
    "id ids ident serial seriennummer sn node knoten nœud nodo input eingang entrée entrada ingresso pin slave module modul "
    "board address addr adresse gain nr no number nummer label name position"
)
#: Words of which one begins or ends a name without blanks that says so: 最大荷重, 目标位移.
WITHOUT_BLANKS = frozenset(w for w in STATISTIC | COMMANDED if not w.isascii() and w[0] > "\u2e80")
#: Names of a column that says which rows are good, and what its cells hold where a row is; of one that says which are not.
VALIDITY: Mapping[str, frozenset[str]] = MappingProxyType(
    {
        **dict.fromkeys(
            _set("valid validity gültig valide válido valido ważny 有效"), _set("1 true yes ok valid y ja oui sí si tak 是")
        ),
        **dict.fromkeys(
            _set("error errors err fault fehler erreur errore błąd invalid 错误"),
            _set("0 false no ok none - n nein non nie 否"),
        ),
    }
)
#: Words of a status or a remark that say that a row is not good.
BAD_ROW = _set(
    "fault error fail failed failure invalid overload overrun overrange overflow alarm bad saturated "
    "saturation clipped clipping outlier spike glitch artefact artifact reject rejected discard discarded fehler ungültig "
    "schlecht ausreißer erreur 错误 异常"
)
#: The same where they are all that a cell says.
BAD_CELL = _set("over ol sat err poor")
#: How a comparator says where a reading lies between limits that were set, which says nothing against it.
COMPARED = _set("in hi lo high low")
#: What stands beside these in its column.
BESIDE_COMPARED = _set("out ok ng go nogo err fail pass off - -- ---")
#: Words that alone mark where a ball turns or waits, and where no press begins.
TURNS = _set(
    "unloading unload unloaded hold holding dwell return retract entlastung entlasten halten rückfahrt décharge maintien "
    "descarga scarico ontlasten odciążenie разгрузка 卸载 卸荷 除荷 保持"
)
#: Words of a name whose column marks rows that are not good, and of one that marks the good ones.
MARKS_BAD = _set(
    "exclude excluded exclusion skip skipped bad outlier outliers reject rejected overload overloaded overrange saturated "
    "saturation clipped clipping overflow masked mask artefact artifact spike glitch discard discarded ignore ignored remove "
    "removed invalid ausreißer ungültig verworfen aberrant exclu rechazado scarto"
)
MARKS_GOOD = _set("ok use usable keep good accept accepted include included valid quality qualität qualité calidad qualità gut")
#: Words of a name beside these that leave it a mark, and of one whose cells may say that a row is not good.
BESIDE_MARK = _set("is row data point reading force load capacitance flag rows the lcr sensor sample")
SAYS_OF_ROW = _set("status flag flags remark remarks comment comments note notes state quality bemerkung kommentar limit range")
#: What a cell says of a row that is meant, and of one that is not.
YES = _set("1 true yes y x t ja j oui o sí si s tak wahr vrai vero hi high lo low on + * ! 是")
NO = _set("0 false no n f ng nok nein non nie falsch faux falso - bad poor invalid fail failed reject rejected schlecht 否")
#: Units that are words of a language, too, or a part of another name.
UNIT_WORDS = _set(
    "in min mil mils thou day days second seconds foot feet pound pounds hour hours tag tage jour jours stunde minute minutes "
    "minuto sec gr kip oz pond hora ore dni dia ft mp sn us kilo kilos"
)
#: Words by which a testing machine says what it does, in a column of its status.
OF_TESTERS = _set(
    "running run loading unloading load unload hold holding dwell stopped stop ramp idle active moving test testing start "
    "started end ended finished preload approach retract return measuring contact waiting pause paused up down forward "
    "backward cycling compression tension läuft fertig ende"
)
#: Words by which a cell marks what happens at a reading.
EVENTS = (OF_TESTERS | PHASES) - _set("direction used mode status") | _set(
    "begin beginning touch touched touchdown turn reversal released release kontakt beginn anfang stopp belastung entlastung "
    "belasten entlasten umkehr start début fin charge décharge inicio carga descarga contacto inizio fine carico scarico "
    "contatto początek koniec старт стоп начало конец нагрузка разгрузка контакт 开始 結束 结束 接触 加载 卸载 停止 終了"
)
