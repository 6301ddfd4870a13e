"""From the words of a name to whether it is of another force, length or capacitance, or not measured: `Querkraft`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType

from calib.lab.instruments.brackets import words_in

# How words begin of what was computed, expected or laid down, and not measured.
_NOT_MEASURED = tuple(
    " ".join(
        (
            "expected assumed assumption ideal planned requested intended theor calculat computed predict estimat",
            "simulat guessed anticipat allowable permissible admissible alarm blank safety inverse reciproc",
            "squared correction interpol extrapol erwart berechn errechn geschätz angenommen annahme",
            "vorhergesag prognos geplant gefordert simulier nennkr nennlast nennweg nennkap zuläss quadrier",
            "kehrwert korrektur théor calculé attendu estimé prédit prévu supposé idéal simulé teór teoric",
            "calculad esperad estimad predich previst supuest planead simulad corrección calcolat attesa atteso",
            "attese attesi stimat predett suppost correzion teóric supost correç bereken verwacht geschat",
            "voorspel aangenomen gesimul gepland ideaal correctie obliczon oblicz teoret oczekiw szacow przewid",
            "założon symulow idealn korekt расчет расчёт вычисл теорет ожида предсказ оценочн симул beräkn",
            "förvänt uppskatt förutsag forvent vypočt vypočít očekáv 理论 理論 计算 計算 预测 預測 予測 预期 預期",
            "期待 假设 假定 仮定 推定 估计 估算 估計 模拟 模擬 仿真 이론 계산 예측 예상 추정 가정 기대",
        )
    ).split()
)
# How words begin, by quantity. None may begin the word of a language for the crosshead, as "quer" and "横" do.
_STEMS: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        quantity: tuple(" ".join(lines).split())
        for quantity, lines in {
            "force": (
                "lateral latéral lateraal shear friction side sideway transvers tangential horizontal radial clamp hold grip",
                "pinch preload pretension prestress spring inertia buoyan cable wire lead noise drift slip adhes torque",
                "uncertaint resolution excitation",
                "erregung anregung speisung excitación eccitazione",
                "querkr querric querlast reib scher seitenkr seitlich halte klemm spann vorspann vorlast vorkraft federkr",
                "rausch cisaill frott tangent serrage maintien précharg precharg précontr ressort bruit",
                "corte cizall fricc rozam sujec apriet precarga resorte muelle ruido",
                "taglio attrit trasvers tangenz serragg bloccagg precaric molla rumore",
                "cisalh atrito fricç fixaç mola ruído",
                "zijde zijw zijk dwarskr schuif wrijv voorspan voorbelast veerkr wryw skuif klam",
                "boczn poprzeczn ścin scin tarci zacisk stycz wstępn sprężyn szum",
                "боков поперечн сдвиг трени касател зажим предвар удержив пружин тангенц шум",
                "sido skjuv frikt tvärkr kläm förspän friksj forspenn sivuvo leikkau kitka poikit esijän kohina",
                "yanal kesme sürtünme enine sıkma gürültü boční příčná smyk třec třen upína šum",
                "oldalir nyír súrlód keresztir zaj forfec frecare",
                "侧向 側向 横向 橫向 横力 横方向 剪切 剪力 摩擦 切向 夹 夾 预紧 預緊 预载 预加载 弹簧 水平 噪",
                "せん断 剪断 接線 側 クランプ 予圧 予荷重 保持 ばね ノイズ",
                "측면 횡방향 횡력 전단 마찰 접선 클램프 예압 예하중 스프링 노이즈",
            ),
            "displacement": (
                "lateral latéral lateraal side sideway transvers horizontal thick width diam radius radial length rough noise",
                "drift slip offset wear runout flatness wavelength amplitude resolution uncertaint toleranc misalign eccentric",
                "spacing pitch waviness",
                "dicke breite durchm länge laenge rauh rauig rauheit querver querweg querric seitlich versatz rausch schlupf",
                "verschlei wellenl toleranz",
                "épaiss epaiss largeu rayon longueur rugosi décalag bruit dérive glisse usure",
                "espesor grosor ancho anchura diámet radio longitud desfas ruido deriva desliz",
                "spessor larghez raggio lunghez rumore scorrim usura espess largur diâmet raio comprim ruído",
                "dikte breedte straal lengte ruwheid ruis",
                "grubo szeroko średn promie długo chropow szum dryf pośliz",
                "толщин ширин диамет радиус длин шерохов шум дрейф проскальз боков поперечн",
                "tjock bredd längd tykk paksuus leveys halkais pituus kalınl geniş çap uzunl",
                "tloušť šířk průměr poloměr délk drsn vastags széles átmér sugár hossz grosime lățime lungime",
                "厚 宽 寬 直径 直徑 半径 半徑 长度 長度 粗糙 噪 漂移 滑移 横向 橫向 侧向 側向 幅 長さ 粗さ ノイズ ドリフト",
                "滑り 두께 폭 직경 지름 반경 길이 거칠기 노이즈 드리프트 슬립",
                "backlash increment inkrement incrément incremento thermal thermisch thermique térmic termic complian nachgieb",
                "umkehrspiel spiel schrittweite stepsize",
            ),
            "capacitance": (
                "cable wire wiring lead stray parasit input internal trim fixture residual leak noise drift offset guard",
                "uncertaint resolution kabel leitung zuleit streu eingang rausch câble parasi fuite bruit cavo fili ingress",
                "rumore cabo ruido ruído przew pasożyt wejści szum кабел паразит вход шум kaapeli kablo",
                "specific spezif spécif especif specifi initial anfangs inizial inicial standard",
                "电缆 電纜 线缆 寄生 杂散 雜散 引线 噪 ケーブル 浮遊 配線 ノイズ 케이블 기생 노이즈",
            ),
        }.items()
    }
)
# Letters of what may stand within a word, too, as "dicke" in "Probendicke"; what is of scripts without blanks always may.
_LONG, _WITHOUT_BLANKS = 5, "\u2e80"


def is_of_another(name: str, quantity: str) -> bool:
    """Whether words say that a column is of another thing in the unit of a quantity.

    Parameters
    ----------
    name : without brackets and unit.
    quantity : of whose unit the column is.

    >>> is_of_another("Querkraft", "force"), is_of_another("Querhauptweg", "displacement"), is_of_another("厚", "displacement")
    (True, False, True)
    """
    words = [word for word in words_in(name) if not word.isdecimal()]
    if not words:
        return False
    return any(_holds(words, stem) for stem in _STEMS.get(quantity, ()))


def was_not_measured(name: str) -> bool:
    """Whether words say that a column was computed, expected or laid down.

    Parameters
    ----------
    name : without brackets and unit.

    >>> was_not_measured("Verwachte kracht"), was_not_measured("理论位移"), was_not_measured("Calibrated force")
    (True, True, False)
    """
    words = words_in(name)
    return bool(words) and any(_holds(words, stem) for stem in _NOT_MEASURED)


def _holds(words: Sequence[str], stem: str) -> bool:
    anywhere = len(stem) >= _LONG or stem > _WITHOUT_BLANKS
    return any(stem in word if anywhere else word.startswith(stem) for word in words)
