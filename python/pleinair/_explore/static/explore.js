// The page of pleinair.explore: sliders, a canvas, and requests to Python of which the latest wins.
//
// A request is {kind, id, view, base, values, coarse}; it holds all that differs from its base (the sky itself or a
// preset), so Python keeps no state for it. At most FLIGHTS are unanswered. While they are, a newer wish of the same kind
// replaces the older one: values in between are dropped, the last is always sent. An answer echoes id and view; a picture
// older than the one shown is not drawn.

const FLIGHTS = 2;
const STILL = 120; // ms without input after which the exact picture is asked for
const SILENCE = 8000; // ms without an answer after which we say so
let views = 0;

function node(tag, properties = {}, ...children) {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(properties)) {
    if (name in made) made[name] = value;
    else made.setAttribute(name, value);
  }
  made.append(...children);
  return made;
}

function requests(model, view, complain) {
  const wanted = new Map(); // kind → function that makes the message when it leaves
  const flying = new Map(); // id → timer of the complaint
  let last = 0;
  function pump() {
    for (const [kind, make] of wanted) {
      if (flying.size >= FLIGHTS) return;
      wanted.delete(kind);
      const id = ++last;
      flying.set(id, setTimeout(complain, SILENCE));
      try {
        model.send({ ...make(), kind, id, view });
      } catch {
        complain();
      }
    }
  }
  return {
    ask(kind, make) {
      wanted.set(kind, make);
      pump();
    },
    landed(id) {
      clearTimeout(flying.get(id));
      flying.delete(id);
      pump();
    },
    stop() {
      wanted.clear();
      for (const timer of flying.values()) clearTimeout(timer);
    },
  };
}

const encode = (x) => (x <= 0.0031308 ? 12.92 * x : 1.055 * x ** (1 / 2.4) - 0.055);
const decode = (x) => (x <= 0.04045 ? x / 12.92 : ((x + 0.055) / 1.055) ** 2.4);

// The colour input shows the hue of three coefficients; choosing one keeps the strength of the strongest.
function toHex(numbers) {
  const most = Math.max(...numbers) || 1;
  const levels = numbers.map((x) => Math.round(255 * encode(Math.max(x, 0) / most)));
  return "#" + levels.map((level) => level.toString(16).padStart(2, "0")).join("");
}

function fromHex(hex, strength) {
  const linear = [1, 3, 5].map((at) => decode(parseInt(hex.slice(at, at + 2), 16) / 255));
  const most = Math.max(...linear);
  return linear.map((x) => (most ? Number(((strength * x) / most).toPrecision(6)) : strength));
}

// Values travel at full precision; this is what a person reads, and what fits into the field.
function short(value) {
  const texts = [5, 4, 3, 2].map((digits) => String(Number(value.toPrecision(digits))));
  return texts.find((text) => text.length <= 8) ?? texts.at(-1);
}

function render({ model, el }) {
  const spec = model.get("spec");
  const begin = model.get("state") ?? {};
  const view = `${Date.now().toString(36)}-${++views}`;
  let base = begin.base ?? "";
  let values = { ...spec.bases[""], ...spec.bases[base], ...begin.values };
  let shown = 0;
  let still = 0;
  let playing = 0;

  const [width, height] = spec.size;
  const canvas = node("canvas", { width, height, tabIndex: 0, role: "img", title: "click to probe" });
  canvas.setAttribute("aria-label", `${spec.title} sky; click, or press Enter for the middle, to probe it`);
  const context = canvas.getContext("2d", { alpha: false });
  const status = node("output", { className: "status" });
  const error = node("p", { className: "error", hidden: true, role: "alert" });
  const text = node("textarea", { readOnly: true, hidden: true, rows: 8, spellcheck: false, ariaLabel: "copied text" });
  const rows = new Map();

  function say(message) {
    error.textContent = message ?? "";
    error.hidden = !message;
  }
  const link = requests(model, view, () => say("Python does not answer: is the kernel busy, or gone?"));
  // Only what differs from the base is sent: a 64-bit seed that no slider touched must not pass through a double.
  const based = (path) => (path in spec.bases[base] ? spec.bases[base][path] : spec.bases[""][path]);
  const changed = () => Object.fromEntries(Object.entries(values).filter(([path, value]) => value !== based(path)));
  const study = () => ({ base, values: changed() });

  function draw() {
    clearTimeout(still);
    link.ask("draw", () => ({ ...study(), coarse: true }));
    still = setTimeout(settle, STILL);
  }
  function settle() {
    clearTimeout(still);
    link.ask("draw", () => ({ ...study(), coarse: false }));
    model.set("state", study());
    model.save_changes();
  }

  // One control: a native range for the hand and the arrow keys, a number for exact and for unusual values.
  function slider(control, put) {
    const id = `pleinair-${view}-${rows.size}-${control.path}`;
    const [low, high] = control.log ? [Math.log2(control.low), Math.log2(control.high)] : [control.low, control.high];
    const range = node("input", { type: "range", id, min: low, max: high, step: control.step });
    const unit = control.unit ? ` [${control.unit}]` : "";
    const number = node("input", { type: "number", step: "any", ariaLabel: control.label + unit });
    range.addEventListener("input", () => put(control.log ? 2 ** range.valueAsNumber : range.valueAsNumber));
    number.addEventListener("change", () => Number.isFinite(number.valueAsNumber) && put(number.valueAsNumber));
    const label = node("label", { htmlFor: id }, control.label);
    const suffix = node("span", { className: "unit" }, control.unit);
    const row = node("div", { className: "row" }, label, range, number, suffix);
    const show = (value) => {
      range.value = control.log ? Math.log2(value) : value;
      range.setAttribute("aria-valuetext", `${short(value)} ${control.unit}`);
      if (document.activeElement !== number || number.valueAsNumber !== value) number.value = short(value);
    };
    return { row, show, range, number };
  }

  const tints = spec.tints.map((tint) => {
    const id = `pleinair-${view}-${tint.label}`;
    const input = node("input", { type: "color", id });
    input.addEventListener("input", () => {
      const strength = Math.max(...tint.of.map((path) => values[path]));
      const chosen = fromHex(input.value, strength || 0.05);
      change(Object.fromEntries(tint.of.map((path, i) => [path, chosen[i]])), input);
    });
    const row = node("div", { className: "row" }, node("label", { htmlFor: id }, tint.label), input);
    return { tint, input, row };
  });

  const hour = spec.day && slider({ path: "hour", label: "hour", low: 0, high: 24, step: 0.05, unit: "h" }, toHour);
  function toHour(now) {
    const at = Math.min(Math.max(now, 0), 23.999);
    const table = spec.day.rows;
    const i = table.findLastIndex((row) => row[0] <= at);
    const t = (at - table[i][0]) / (table[i + 1][0] - table[i][0]);
    const mixed = [1, 2].map((k) => table[i][k] + t * (table[i + 1][k] - table[i][k]));
    hour.show(at);
    change(Object.fromEntries(spec.day.of.map((path, k) => [path, mixed[k]])), hour);
  }

  function change(some, source) {
    values = { ...values, ...some };
    refresh(source);
    draw();
  }
  function refresh(source) {
    for (const [path, row] of rows) if (values[path] != null) row.show(values[path]);
    for (const { tint, input } of tints) if (input !== source) input.value = toHex(tint.of.map((path) => values[path]));
    if (hour && source !== hour) {
      const off = (row) => spec.day.of.reduce((sum, path, k) => sum + (row[k + 1] - values[path]) ** 2, 0);
      hour.show(spec.day.rows.reduce((a, b) => (off(b) < off(a) ? b : a))[0]);
    }
  }

  const groups = new Map();
  function into(group, row) {
    if (!groups.has(group)) groups.set(group, node("fieldset", {}, node("legend", {}, group)));
    groups.get(group).append(row);
  }
  for (const control of spec.controls) {
    const row = slider(control, (value) => change({ [control.path]: value }));
    row.range.name = control.path;
    rows.set(control.path, row);
    into(control.group, row.row);
  }
  for (const { tint, row } of tints) rows.get(tint.of.at(-1)).row.after(row);

  const auto = node("input", { type: "checkbox", id: `pleinair-${view}-auto`, checked: values.exposure == null });
  auto.addEventListener("change", () => {
    const { exposure } = canvas.dataset; // what the picture has now is where a locked exposure begins
    change({ exposure: auto.checked ? null : Number(exposure ?? 1) });
  });
  into("View", node("div", { className: "row" }, node("label", { htmlFor: auto.id }, "auto exposure"), auto));
  rows.get("exposure").range.addEventListener("input", () => (auto.checked = false));
  rows.get("exposure").number.addEventListener("change", () => (auto.checked = false));

  const play = node("button", { type: "button", ariaLabel: "play the day" }, "▶");
  play.addEventListener("click", () => {
    const tick = () => {
      toHour((hour.range.valueAsNumber + 0.1) % 24);
      playing = setTimeout(tick, 50);
    };
    if (playing) clearTimeout(playing), (playing = 0);
    else tick();
    play.textContent = playing ? "⏸" : "▶";
  });
  if (hour) {
    hour.row.lastChild.replaceWith(play);
    groups.get("Sun").querySelector("legend").after(hour.row);
  }

  const preset = node("select", { id: `pleinair-${view}-preset` });
  for (const name of Object.keys(spec.bases)) preset.append(node("option", { value: name }, name || "as given"));
  preset.value = base;
  preset.addEventListener("change", () => {
    base = preset.value;
    change(spec.bases[base]);
    settle();
  });

  const copies = [["python", "Copy as Python"], ["json", "Copy JSON"]].filter(([kind]) => kind !== "json" || spec.json);
  const buttons = copies.map(([kind, label]) => {
    const button = node("button", { type: "button" }, label);
    button.addEventListener("click", () => link.ask(kind, study));
    return button;
  });

  function probe(x, y) {
    link.ask("probe", () => ({ ...study(), x, y }));
  }
  canvas.addEventListener("click", (event) => {
    const box = canvas.getBoundingClientRect();
    const [x, y] = [(event.clientX - box.left) / box.width, (event.clientY - box.top) / box.height];
    probe(x * canvas.width, y * canvas.height);
  });
  canvas.addEventListener("keydown", (event) => {
    if (event.key === "Enter") probe(canvas.width / 2, canvas.height / 2);
  });

  async function paint(header, buffer) {
    const file = new Blob([buffer], { type: header.mime });
    const picture = await createImageBitmap(file, { colorSpaceConversion: "none" });
    if (header.id > shown) {
      shown = header.id;
      context.drawImage(picture, 0, 0, canvas.width, canvas.height);
      Object.assign(canvas.dataset, { shown, coarse: header.coarse, exposure: header.exposure });
      status.textContent = `${header.width} × ${header.height} · ${header.ms} ms`;
      if (values.exposure == null) rows.get("exposure").show(header.exposure);
      say(header.note);
    }
    picture.close();
  }
  async function copied(header) {
    if (header.of === "probe") {
      status.textContent = header.text;
      return;
    }
    text.hidden = false;
    text.value = header.text;
    const done = await navigator.clipboard?.writeText(header.text).then(() => true, () => false);
    if (!done) text.select();
    status.textContent = done ? "copied" : "press Ctrl-C to copy";
  }
  function answered(header, buffers) {
    if (header.view !== view) return; // another view of the same widget asked
    link.landed(header.id);
    if (header.kind === "picture") paint(header, buffers[0]);
    else if (header.kind === "text") copied(header);
    else if (header.id > shown) say(header.text);
  }
  model.on("msg:custom", answered);

  const poster = model.get("poster");
  if (poster?.byteLength) paint({ id: 0.5, mime: "image/jpeg", coarse: true, width, height, ms: "–" }, poster);
  const choose = node("label", { htmlFor: preset.id }, "Preset");
  const tools = node("div", { className: "tools" }, choose, preset, ...buttons);
  const stage = node("div", { className: "stage" }, canvas, status, error, tools, text);
  el.classList.add("pleinair");
  el.append(stage, node("div", { className: "panel" }, ...groups.values()));
  refresh();
  settle();

  return () => {
    clearTimeout(still);
    clearTimeout(playing);
    link.stop();
    model.off("msg:custom", answered);
  };
}

export default { render };
