"use strict";
// What makes the pages quick to work with. All of it but the dropping of files and the sliders can be done without it.

document.documentElement.classList.add("scripted");
const one = (selector, within = document) => within.querySelector(selector);
const all = (selector, within = document) => [...within.querySelectorAll(selector)];

function element(name, text, attributes = {}) {
  const made = document.createElement(name);
  made.textContent = text;
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  return made;
}

// A command whose words stay whole where a line of a small screen ends.
function showCommand(target, text) {
  target.replaceChildren(...text.split(" ").flatMap((word, k) => [...(k ? [" "] : []), element("span", word, { class: "word" })]));
}

const shutOut = "This page is of an earlier server, or was not let in: open the address that `calib serve` shows in its terminal. What is in the folder is not lost.";

async function ask(address, options = {}) {
  try {
    return await fetch(address, { cache: "no-store", ...options });
  } catch (error) {
    if (error.name === "AbortError") throw error;
    throw new Error("The server does not answer. Start `calib serve` again; what is in the folder is not lost.");
  }
}

async function answer(address, options = {}) {
  const got = await ask(address, { ...options, headers: { Accept: "application/json", ...options.headers } });
  let said = {};
  try { said = await got.json(); } catch { said = { faults: [got.status === 403 ? shutOut : `The server answered with ${got.status}.`] }; }
  return { ok: got.ok, status: got.status, said };
}

// --- parts of a page that load by themselves -------------------------------------------------------------------------

const loading = new WeakMap();

async function load(part) {
  loading.get(part)?.abort();
  const stop = new AbortController();
  loading.set(part, stop);
  let text, alive = "", gone = false;
  try {
    const got = await ask(part.dataset.load, { signal: stop.signal, headers: { "X-Part": "1" } });
    if (got.status === 403) throw new Error(shutOut);
    alive = got.headers.get("X-Alive");
    gone = got.status === 422;
    text = await got.text();
  } catch (error) {
    if (error.name === "AbortError") return;
    text = "";
    part.replaceChildren(element("p", error.message, { class: "note" }));
  }
  if (text) {
    const open = all("details[open]", part).length > 0;
    part.innerHTML = text;
    if (open) all("details", part).forEach((d) => { d.open = true; });
    begin(part);
  }
  if (part.dataset.then === "look" && one("#look", part)) lookAbout();
  if (!part.dataset.again || gone) return;
  if (alive === "no") { location.reload(); return; }
  tell(part);
  setTimeout(() => load(part), Number(part.dataset.again));
}

// A page that changes every second would never let a screen reader rest: it is told of a new stage, and every 20 seconds.
let told = { stage: "", at: 0 };
function tell(part) {
  const said = one("#progress-said");
  const stage = one("strong", part)?.textContent ?? "";
  if (said && (stage !== told.stage || Date.now() - told.at > 20000)) {
    said.textContent = all("p, dt, dd", part).map((p) => p.textContent.trim().replace(/[.…\s]+$/, "")).filter(Boolean).join(". ");
    told = { stage, at: Date.now() };
  }
}

// Of a long list what is on the screen is loaded, a few at a time: a folder may hold ten thousand files.
const waiting = [];
let under = 0;
function inTurn() {
  while (waiting.length && under < 4) {
    under += 1;
    load(waiting.shift()).finally(() => { under -= 1; inTurn(); });
  }
}
const inSight = new IntersectionObserver((seen) => {
  for (const { target } of seen.filter((s) => s.isIntersecting)) { inSight.unobserve(target); waiting.push(target); }
  inTurn();
}, { rootMargin: "600px" });

// What a page, or a part of it that has just been loaded, does by itself.
function begin(within) {
  for (const part of all("[data-load]", within)) {
    if (part.dataset.again) {
      part.removeAttribute("aria-live");
      part.removeAttribute("role");
      part.after(element("p", "", { id: "progress-said", class: "out", role: "status" }));
    }
    if (part.tagName === "LI") inSight.observe(part);
    else load(part);
  }
  for (const button of all("button[data-from]", within)) {
    button.addEventListener("click", () => {
      const into = document.getElementById(button.dataset.into);
      into.textContent = "Looking …";
      into.dataset.load = button.dataset.from;
      load(into);
    });
  }
  // The command that a form stands for, as it is filled in. Answers may overtake each other: that of the last letter counts.
  for (const form of all("form[data-command]", within)) {
    let last = "";
    form.addEventListener("input", async () => {
      const filled = last = String(new URLSearchParams(new FormData(form)));
      const { ok, said } = await answer(`${form.dataset.command}?${filled}`);
      if (ok && filled === last) showCommand(document.getElementById(form.dataset.into ?? "command"), said.command);
    });
  }
  for (const form of all("form[data-command], form[data-here]", within)) {
    form.addEventListener("submit", (event) => {
      const button = one("button[type=submit]", form);
      const busy = element("span", form.dataset.busy ?? "", { class: "note", role: "status" });
      one(".said", form)?.remove();
      button.disabled = true;
      button.parentElement.append(busy);
      if (form.method !== "post") return;
      // A refusal is said where the button is, and what was typed stays.
      event.preventDefault();
      const sent = { method: "POST", body: new URLSearchParams(new FormData(form)), headers: { Accept: "application/json" } };
      ask(form.getAttribute("action"), sent).then(async (got) => {
        if (got.ok) { location.assign(got.url); return; }
        const said = got.status === 403 ? shutOut : await got.json().then((json) => json.faults.join(" "), () => `The server answered with ${got.status}.`);
        throw new Error(said);
      }).catch((error) => {
        busy.remove();
        button.disabled = false;
        button.parentElement.before(element("p", error.message, { class: "said", role: "alert" }));
      });
    });
  }
  // Questions that only some answers raise.
  for (const form of all("form", within)) {
    const asked = all("[data-when]", form);
    if (!asked.length) continue;
    const sort = () => {
      for (const part of asked) {
        const value = form.elements[part.dataset.when].value;
        const wanted = "only" in part.dataset ? value === part.dataset.only : value !== "" && value !== part.dataset.unless;
        part.hidden = !wanted;
      }
    };
    form.addEventListener("change", sort);
    sort();
  }
  for (const select of all(".pick select", within)) select.addEventListener("change", () => select.form.submit());
}
// A page that the browser brings back has its buttons as they were left.
window.addEventListener("pageshow", (event) => { if (event.persisted) location.reload(); });
begin(document);

// --- dropping files --------------------------------------------------------------------------------------------------

async function filesOf(entry, before = "") {
  if (entry.isFile) return [[before + entry.name, await new Promise((done, fail) => entry.file(done, fail))]];
  const reader = entry.createReader(), found = [];
  for (;;) {
    const some = await new Promise((done, fail) => reader.readEntries(done, fail));
    if (!some.length) break;
    found.push(...some);
  }
  return (await Promise.all(found.map((inside) => filesOf(inside, `${before}${entry.name}/`)))).flat();
}

async function send(files) {
  const list = one("#dropped");
  const kept = files.filter(([name]) => !name.split("/").some((part) => part.startsWith(".")));
  list.replaceChildren();
  let refused = 0;
  for (const [name, file] of kept) {
    const line = element("p", `${name}: copying …`);
    list.append(line);
    try {
      const { ok, said } = await answer(`/files/upload?name=${encodeURIComponent(name)}`, { method: "PUT", body: file });
      line.textContent = ok ? `${name}: copied` : said.faults.join(" ");
      line.className = ok ? "good" : "bad";
      refused += !ok;
    } catch (error) {
      line.textContent = `${name}: ${error.message}`;
      line.className = "bad";
      refused += 1;
    }
  }
  if (kept.length > refused) {
    if (refused) list.append(element("a", "Show what was understood of the others", { href: "/files", class: "button" }));
    else location.assign("/files");
  }
}

const drop = one("#drop");
if (drop) {
  for (const name of ["dragenter", "dragover"]) drop.addEventListener(name, (event) => { event.preventDefault(); drop.classList.add("over"); });
  drop.addEventListener("dragleave", () => drop.classList.remove("over"));
  drop.addEventListener("drop", async (event) => {
    event.preventDefault();
    drop.classList.remove("over");
    const entries = [...event.dataTransfer.items].map((item) => item.webkitGetAsEntry?.()).filter(Boolean);
    send(entries.length ? (await Promise.all(entries.map((e) => filesOf(e)))).flat() : [...event.dataTransfer.files].map((f) => [f.name, f]));
  });
  for (const input of all("input[type=file]")) {
    input.addEventListener("change", () => send([...input.files].map((f) => [f.webkitRelativePath || f.name, f])));
  }
}

for (const button of all("button[data-field]")) {
  button.addEventListener("click", () => {
    const form = one("#correction");
    let field = button.dataset.field;
    if (button.dataset.column) {
      // Columns that are asked for already stay.
      const asked = all("input[name^=where_column]", form).find((input) => ["", button.dataset.column].includes(input.value.trim()));
      asked.value = button.dataset.column;
      field = asked.name.replace("column", "value");
    }
    form.elements[field].value = button.dataset.value;
    form.requestSubmit();
  });
}

// --- the experiment --------------------------------------------------------------------------------------------------

const text = one("#text"), fields = one("#fields");
if (text) {
  const seen = one("#seen"), said = one("#said"), state = one("#text-state"), light = one("#light");
  const forms = JSON.parse(fields.dataset.forms);
  let dirty = false, drawing = false, wait = 0, waitLight = 0, queue = Promise.resolve();

  // What was typed into fields and is not in the file, each with what stood there before; what is said in .decide counts with its button.
  const typed = new Map();
  const unwritten = (deciding, within = fields) => [...typed].some(([input, was]) =>
    within.contains(input) && input.value !== was && (deciding || !input.closest(".decide")));

  // A verdict is of the text that was checked: as soon as another stands here, none is shown.
  function unchecked(level, words) {
    clearTimeout(waitLight);
    loading.get(light)?.abort();
    if (one(".unchecked", light) && light.textContent === `${level} ${words}`) return; // said once
    const line = element("p", "");
    line.append(element("span", level, { class: "unchecked" }), ` ${words}`);
    light.replaceChildren(line);
  }
  const changed = () => unchecked("not checked yet", "what is typed is not in the file yet");
  const lost = () => unchecked("not checked", "what was changed is not in the file");
  function checkSoon() {
    if (dirty || unwritten(false)) { changed(); return; }
    unchecked("being checked", "what the file now holds …");
    waitLight = setTimeout(() => load(light), 500);
  }

  function show(now) {
    if (!dirty) { text.value = now.text; state.textContent = "as in the file"; }
    seen.value = now.seen;
    one("#marked").textContent = now.marked;
    for (const form of all(".field[data-field]", fields)) {
      const field = now.fields[form.dataset.field];
      if (!field) continue;
      form.elements.was.value = field.was;
      if (form.elements.known && form.dataset.known !== field.known) form.elements.known.value = form.dataset.known = field.known;
      form.classList.toggle("wrong", Boolean(field.wrong));
      form.classList.toggle("marked", Boolean(field.task));
      const check = one(".check", form);
      check.replaceChildren(
        field.wrong ? element("span", `✗ ${field.wrong}`, { class: "bad" })
          : field.value === null ? element("span", field.usual ? "as usual" : "not given", { class: "note" })
            : element("span", `✓ ${field.read || "fine"}`, { class: "good" }));
      for (const input of all("input:not([type=hidden])", form)) input.toggleAttribute("aria-invalid", Boolean(field.wrong));
      if (!field.task) one(".task", form)?.remove();
    }
    let faults = one(":scope > .faults", fields);
    if (!faults) { faults = element("div", "", { class: "faults", role: "alert" }); fields.prepend(faults); }
    const list = element("ul", "");
    for (const fault of now.faults) list.append(element("li", fault));
    faults.replaceChildren(list);
    faults.hidden = !now.faults.length;
    checkSoon();
  }

  function draw(now) {
    const held = document.activeElement, typing = fields.contains(held) && typed.has(held);
    // A field that is taken out of the page while somebody is in it loses the focus, which is not that they have left it.
    drawing = true;
    fields.innerHTML = now.drawn;
    drawing = false;
    const again = held?.id ? document.getElementById(held.id) : null;
    if (!again) return;
    again.focus();
    if (!typing) {
      if (held.matches("input[autocomplete=off]")) again.setSelectionRange(held.selectionStart, held.selectionEnd); // about to type
      return;
    }
    typed.set(again, again.value);
    // Somebody is in the middle of a word: it stays, and is put into the file when they leave the field.
    again.value = held.value;
    again.setSelectionRange(held.selectionStart, held.selectionEnd);
    again.addEventListener("blur", () => { if (!drawing) again.dispatchEvent(new Event("change", { bubbles: true })); }, { once: true });
  }

  function change(address, data, redraw, form) {
    unchecked("being checked", "what was changed is written first …");
    // One after the other: each is of what the one before has made.
    queue = queue.then(async () => {
      try {
        const { ok, status, said: now } = await answer(address, { method: "POST", body: new URLSearchParams(data()) });
        said.textContent = ok ? "" : (now.refused ?? now.faults.join(" "));
        if (!ok) lost();
        if (ok || status === 409) {
          for (const input of form?.elements ?? []) typed.delete(input);
          if (ok && address.endsWith("write")) dirty = text.value.replaceAll("\r\n", "\n") !== now.text;
          show(now);
          if (redraw || status === 409) draw(now);
        }
        return ok;
      } catch (error) { said.textContent = error.message; lost(); return false; }
    });
    return queue;
  }

  fields.addEventListener("beforeinput", (event) => { if (!typed.has(event.target)) typed.set(event.target, event.target.value); });
  fields.addEventListener("input", (event) => { if (event.target.matches("input") && !event.target.closest(".decide")) changed(); });
  fields.addEventListener("focusout", () => { if (!drawing && light.textContent.startsWith("not checked yet")) checkSoon(); });
  fields.addEventListener("change", (event) => {
    const form = event.target.closest("form");
    if (drawing || !form || event.target.closest(".decide")) return; // what is said there counts with its button
    if ("add" in form.dataset) {
      if (form.elements.at.value) change("/experiment/put", () => ({ at: form.elements.at.value, example: "yes", was: "null" }), true);
      return;
    }
    if (event.target.name === "kind" && event.target.value) {
      const names = forms[event.target.value], id = event.target.id;
      all(".prior .number", form).forEach((number) => number.remove());
      names.forEach((name, k) => {
        const number = element("span", "", { class: "number" });
        number.append(element("label", name, { for: `${id}-${k}` }), element("input", "", { id: `${id}-${k}`, name: `number${k}`, autocomplete: "off" }));
        one(".prior", form).append(number);
        typed.set(one("input", number), null);
      });
      one(".prior .number input", form).focus();
      changed();
      return;
    }
    if (all(".prior .number input", form).some((input) => !input.value.trim()) && form.elements.kind?.value) return;
    change("/experiment/put", () => new FormData(form), event.target.name === "kind", form);
  });
  fields.addEventListener("submit", (event) => {
    event.preventDefault();
    const form = event.target, decide = event.submitter?.dataset.decide ?? (document.activeElement.closest(".decide") ? form.elements.known.value : "");
    const put = () => change("/experiment/put", () => new FormData(form), false, form);
    if (!decide) { put(); return; }
    form.elements.known.value = decide;
    // What was typed above and is not in the file yet is what was measured.
    queue.then(() => (unwritten(false, form) ? put() : true)).then((written) => {
      if (!written) return;
      change("/experiment/decide", () => new FormData(form), true, form)
        .then(() => one(`#fields [data-field='${CSS.escape(form.dataset.field)}'] input[name=known]:checked`)?.focus());
    });
  });

  const write = () => { clearTimeout(wait); change("/experiment/write", () => ({ text: text.value, seen: seen.value }), true); };
  text.addEventListener("input", () => {
    dirty = true;
    state.textContent = "changed, not written yet";
    changed();
    clearTimeout(wait);
    wait = setTimeout(write, 800);
  });
  one("#text-form").addEventListener("submit", (event) => { event.preventDefault(); write(); });
  window.addEventListener("beforeunload", (event) => {
    if (!dirty && !unwritten(true)) return;
    event.preventDefault();
    event.returnValue = true; // what older browsers go by
  });

  // Another tab, an editor or the command line may change the file.
  async function look() {
    if (document.hidden || dirty) return;
    try {
      const { ok, said: now } = await answer("/experiment/state");
      if (ok && !dirty && now.seen !== seen.value) { show(now); draw(now); state.textContent = "changed elsewhere: this is what the file holds now"; }
    } catch { /* said where something is done */ }
  }
  const lookNext = () => { queue = queue.then(look); };
  document.addEventListener("visibilitychange", lookNext);
  setInterval(lookNext, 4000);
}

// --- padding ---------------------------------------------------------------------------------------------------------

function lookAbout() {
  const look = one("#look");
  const W = 400, H = 230, L = 44, B = 28, T = 12;
  const at = one("#at"), loadAt = one("#load"), said = one("#look-said"), seen = one("#seen");
  let view = null, asking = false, asked = "", rest = false, began = 0;

  const svg = (name, attributes, words = "") => {
    const made = document.createElementNS("http://www.w3.org/2000/svg", name);
    for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
    made.textContent = words;
    return made;
  };
  const between = (values, x) => {
    const h = view.thickness, k = Math.min(Math.max(h.findIndex((v) => v >= x), 1), h.length - 1);
    const share = (x - h[k - 1]) / (h[k] - h[k - 1]), a = values[k - 1], b = values[k];
    if (share <= 0) return a;
    if (share >= 1) return b;
    return a === null || b === null ? null : a + share * (b - a);
  };
  const nice = (most) => { const p = 10 ** (Math.floor(Math.log10(most)) - 1); return [1, 2, 2.5, 5, 10, 20].map((m) => m * p).find((s) => most / s <= 5); };
  const number = (value, digits = 3) => (value === null ? "not covered" : String(Number(value.toPrecision(digits))));

  // As many decimals as the width of an interval deserves, two of its digits: the same for both ends and for what lies between.
  const placesOf = (width) => (width > 0 ? Math.min(Math.max(1 - Math.floor(Math.log10(width)), 0), 9) : 3);

  // A finite number of draws shows no certainty.
  const percent = (p) => (p === null ? "not covered" : p > 0.99 ? "more than 99 %" : p < 0.01 ? "less than 1 %" : `${Math.round(100 * p)} %`);

  const middle = (value, bands) => {
    const width = bands.length === 5 ? between(bands[4], Number(at.value)) - between(bands[0], Number(at.value)) : 0;
    return value === null ? "not covered" : value.toFixed(placesOf(width));
  };

  function draw(target, bands, limits, top, label = middle) {
    const h = view.thickness, last = h.at(-1);
    const most = top ?? Math.max(...bands.flat().filter((v) => v !== null), ...limits, 1e-9) * 1.06;
    const x = (v) => L + (v - h[0]) / (last - h[0]) * (W - L - 8), y = (v) => H - B - Math.min(v, most) / most * (H - B - T);
    const made = [];
    const step = nice(most);
    for (let v = 0; v <= most * 1.0001; v += step) {
      made.push(svg("line", { class: "grid", x1: L, x2: W - 8, y1: y(v), y2: y(v) }));
      made.push(svg("text", { x: L - 6, y: y(v) + 4, "text-anchor": "end" }, String(Number(v.toPrecision(6)))));
    }
    for (let v = Math.ceil(h[0]); v <= last; v += 1) made.push(svg("text", { x: x(v), y: H - 8, "text-anchor": "middle" }, String(v)));
    const from = view.colour.map((c, k) => (c === "green" ? null : k)).filter((k) => k !== null);
    for (const k of from) {
      const a = x(h[Math.max(k - 1, 0)]) / 2 + x(h[k]) / 2, b = x(h[k]) / 2 + x(h[Math.min(k + 1, h.length - 1)]) / 2;
      made.push(svg("rect", { class: "beyond", x: a, y: T, width: b - a, height: H - B - T }));
    }
    const runs = [];
    h.forEach((_, k) => { if (bands.every((band) => band[k] !== null)) { if (bands[0][k - 1] === null || !runs.length || runs.at(-1).at(-1) !== k - 1) runs.push([]); runs.at(-1).push(k); } });
    for (const run of runs) {
      const line = (band, order) => order.map((k) => `${x(h[k]).toFixed(1)},${y(band[k]).toFixed(1)}`).join(" ");
      const back = [...run].reverse();
      if (bands.length === 5) {
        made.push(svg("polygon", { class: "outer", points: `${line(bands[0], run)} ${line(bands[4], back)}` }));
        made.push(svg("polygon", { class: "inner", points: `${line(bands[1], run)} ${line(bands[3], back)}` }));
      }
      made.push(svg("polyline", { class: "median", points: line(bands.length === 5 ? bands[2] : bands[0], run) }));
    }
    for (const v of limits) made.push(svg("line", { class: "limit", x1: L, x2: W - 8, y1: y(v), y2: y(v) }));
    const now = Number(at.value), value = between(bands.length === 5 ? bands[2] : bands[0], now);
    made.push(svg("line", { class: "mark", x1: x(now), x2: x(now), y1: T, y2: H - B }));
    made.push(svg("text", { class: "now", x: Math.min(x(now) + 5, W - 104), y: T + 12 }, label(value, bands)));
    target.setAttribute("viewBox", `0 0 ${W} ${H}`);
    target.replaceChildren(...made);
  }

  const wanted = (name, scale) => {
    const input = look.elements[name].value.trim().replace(",", "."), value = parseFloat(input);
    return Number.isFinite(value) ? [input.endsWith("%") || scale === 1 ? value : value * scale] : [];
  };

  function show(settled) {
    one("#at-shown").textContent = `${Number(at.value).toFixed(2)} mm`;
    at.setAttribute("aria-valuetext", `${Number(at.value).toFixed(2)} millimetres`);
    loadAt.setAttribute("aria-valuetext", `${Number(Number(loadAt.value).toPrecision(4))} newtons`);
    if (!view) return;
    const far = one("#load-beyond");
    far.replaceChildren(...(view.beyond ? [element("span", "extrapolated", { class: "level amber" }), ` ${view.beyond}: held against no data there.`] : []));
    one("#charts").hidden = false;
    draw(one("#chart-signal"), view.signal, wanted("signal", 100));
    draw(one("#chart-stroke"), view.stroke, wanted("stroke", 1));
    one("#conforming").hidden = view.limits.length === 0; // without limits there is nothing to conform with
    draw(one("#chart-conforming"), [view.conforming.map((p) => (p === null ? null : 100 * p))], [], 100, (v) => percent(v === null ? null : v / 100));
    const x = Number(at.value), band = (bands, unit) => {
      const [low, middle, high] = [0, 2, 4].map((k) => between(bands[k], x));
      if (middle === null) return "not covered by the model";
      const [from, about, to] = [low, middle, high].map((v) => v.toFixed(placesOf(high - low)));
      return `${about} ${unit} (90 % between ${from} and ${to} ${unit})`;
    };
    const p = between(view.conforming, x), near = Math.round((x - view.thickness[0]) / view.step);
    const colour = view.light[near], fails = view.limits.map((name, k) => [name, between(view.fails[k], x)]).filter(([, f]) => f > 0.005);
    seen.setAttribute("aria-live", settled ? "polite" : "off");
    const covered = between(view.signal[2], x) !== null;
    seen.replaceChildren(
      element("strong", `${x.toFixed(2)} mm of padding at ${number(view.force)} N: `),
      !covered ? `not covered by the model, which at this load covers ${view.spans ? `${view.spans} of padding` : "no padding that is looked at"}. ` : `signal ${band(view.signal, "%")}, stroke ${band(view.stroke, "mm")}`
        + (view.resolution[2].some((v) => v !== null) ? `, one reading tells ${band(view.resolution, "mN")} from noise` : "") + ". "
        + (view.limits.length ? `Probability that it conforms: ${percent(p)}`
          + (fails.length ? `; missed: ${fails.map(([name, f]) => `${name} by ${percent(f)} of the draws`).join(", ")}` : "") + ". " : ""),
      element("span", colour, { class: `level ${colour}` }),
      colour === "green" ? "" : ` ${view.reason[near]}`);
    document.documentElement.dataset.lag = String(performance.now() - began);
  }

  // A load that is typed goes as far as one says; the slider then reaches there, too.
  const force = one("#force"), plain = /^\s*[\d.]+\s*$/;
  const wish = () => {
    const data = new FormData(look), load = data.get("force").replace(",", ".");
    data.set("force", plain.test(load) ? `${load.trim()} N` : load);
    return String(new URLSearchParams(data));
  };
  const slid = () => { force.value = `${Number(Number(loadAt.value).toPrecision(4))} N`; };
  function reach(now) {
    if (now.most === Number(loadAt.max)) return;
    loadAt.max = now.most;
    loadAt.min = now.most / 100;
    loadAt.step = 10 ** (Math.floor(Math.log10(now.most)) - 2);
  }

  // What is asked for stands in the address of the page: it is there again when the page is loaded again.
  let kept = wish();
  function keep(query) {
    if (query === kept) return;
    kept = query;
    const given = [...new URLSearchParams(query)].filter(([, value]) => value.trim());
    history.replaceState(history.state, "", `/padding?${new URLSearchParams(given)}`);
  }

  async function update(settled) {
    const query = wish();
    rest = settled;
    if (settled) keep(query);
    if (asking) return; // what is asked for meanwhile is asked for afterwards
    if (query === asked) { show(rest); return; }
    asking = true;
    const long = setTimeout(() => { one("#load-beyond").textContent = "Computing what the draws do there …"; }, 400);
    try {
      const { ok, said: now } = await answer(`${look.dataset.view}?${query}`);
      said.textContent = ok ? "" : now.faults.join(" ");
      asked = query;
      if (ok) {
        view = now;
        showCommand(one("#command"), now.command);
        reach(now);
        if (document.activeElement !== loadAt) loadAt.value = now.force;
        show(rest);
      }
      else one("#load-beyond").textContent = "";
    } catch (error) { said.textContent = error.message; asked = query; }
    clearTimeout(long);
    asking = false;
    if (wish() !== asked) update(rest);
  }

  at.addEventListener("input", () => { began = performance.now(); show(false); });
  at.addEventListener("change", () => { began = performance.now(); show(true); });
  loadAt.addEventListener("input", () => { began = performance.now(); slid(); show(false); update(false); });
  loadAt.addEventListener("change", () => update(true));
  let wait = 0;
  force.addEventListener("input", () => {
    began = performance.now();
    clearTimeout(wait);
    wait = setTimeout(() => update(true), 60);
  });
  force.addEventListener("change", () => {
    force.value = force.value.replace(",", ".");
    if (plain.test(force.value)) force.value = `${force.value.trim()} N`;
    began = performance.now();
    update(true);
  });
  for (const input of all(".limits input", look)) {
    input.addEventListener("input", () => { clearTimeout(wait); wait = setTimeout(() => { began = performance.now(); update(true); }, 150); });
  }
  // Enter in any field does what stands beside the load: it shows. The advice is made by its own button, and once.
  const advise = one(".buttons button", look);
  look.addEventListener("submit", (event) => {
    if (event.submitter !== advise) {
      event.preventDefault();
      force.dispatchEvent(new Event("change"));
    } else if (advise.disabled) event.preventDefault();
    else setTimeout(() => { advise.disabled = true; });
  });
  began = performance.now();
  show(false);
  // What lies beyond the slider takes a second to table: it is made before somebody asks for it.
  update(true).then(() => {
    const ahead = new URLSearchParams({ name: look.elements.name.value, force: `${2 * Number(loadAt.max)} N` });
    answer(`${look.dataset.view}?${ahead}`).catch(() => {});
  });
}
