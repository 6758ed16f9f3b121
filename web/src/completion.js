// Completion and help on hovering. The names are those of the API, as the cockpit lists them, and the objects and
// parameters of the running scene.
import { completeAnyWord, snippetCompletion } from "@codemirror/autocomplete";
import { EditorState } from "@codemirror/state";
import { hoverTooltip } from "@codemirror/view";

const PHASES = {
  init: "Called once, before the first step.",
  actuation: "Called in every step, before the dynamics: command the drone here.",
  sensing: "Called in every step, after the dynamics: read sensors here.",
  cleanup: "Called once, at the end.",
  thread: "A thread: goes on from step to step, and waits by sim.step or sim.wait.",
};
const SELF = /\bself\.([A-Za-z_]\w*)/g;
const IN_CALL = /\bsim\w*[.\w]*\s*\([^()]*$/;
const OF_PARAMETERS = /param/i;
const LONGEST_LINE = 1000; // characters; longer lines get neither completion nor help

const createElement = (tag, className, textContent) => Object.assign(document.createElement(tag), { className, textContent });

// Return the index at which a string begins that is still open at the end of `line`, -1 outside strings and in comments.
function openString(line, comment) {
  let quote = "";
  let from = -1;
  for (let at = 0; at < line.length; at++) {
    const one = line[at];
    if (quote) {
      if (one === "\\") at++;
      else if (one === quote) quote = "";
    } else if (one === '"' || one === "'") {
      quote = one;
      from = at + 1;
    } else if (line.startsWith(comment, at)) return -1;
  }
  return quote ? from : -1;
}

// The known names: those of the API, requested once, and those of the scene, which may change.
export class Known {
  constructor() {
    this.modules = new Map(); // function entries by function name, by module name
    this.flat = new Map(); // entries by the flat names of CoppeliaSim 3, such as simGetObjectPosition
    this.constants = new Map();
    /** @type {wire.Questions["inspect"][1]} */
    this.names = { objects: [], parameters: [] };
  }

  take({ functions, constants }) {
    for (const [module, name, flat, generations, given, sentence, page, isIgnored] of functions) {
      const entry = { label: name, shown: `${module}.${name}(${given})`, flat, generations, given, sentence, page, isIgnored };
      if (!this.modules.has(module)) this.modules.set(module, new Map());
      this.modules.get(module).set(name, entry);
      this.flat.set(flat, { ...entry, label: flat, shown: `${flat}(${given})` });
    }
    for (const [name, value] of Object.entries(constants)) {
      const sentence = `A constant of CoppeliaSim's: ${value}.`;
      this.constants.set(name, { label: name, shown: `sim.${name} = ${value}`, sentence, value });
      this.flat.set(`sim_${name}`, { label: `sim_${name}`, shown: `sim_${name} = ${value}`, sentence, value });
    }
  }

  // Return the entry of a name in `module`, or of a flat name or callback if `module` is undefined; undefined if unknown.
  find(module, name) {
    if (!module) return this.flat.get(name) ?? this.phase(name);
    return this.modules.get(module)?.get(name) ?? (module === "sim" ? this.constants.get(name) : undefined);
  }

  phase(name) {
    const sentence = PHASES[name.replace("sysCall_", "")];
    return name.startsWith("sysCall_") && sentence ? { shown: `${name}()`, sentence } : undefined;
  }
}

// Return the help card of an entry: the call, one sentence, and a link to the manual.
function card({ shown, sentence, page }) {
  const dom = createElement("div", "api-card", "");
  dom.append(createElement("code", "", shown), createElement("p", "", sentence));
  if (page) {
    const link = createElement("a", "", "CoppeliaSim's manual");
    Object.assign(link, { href: page, target: "_blank", rel: "noopener noreferrer" });
    dom.append(link);
  }
  return dom;
}

function option(entry, type) {
  const boost = entry.generations === undefined ? -1 : entry.isIgnored ? -2 : entry.generations.includes("5") ? 1 : 0;
  const detail = entry.given === undefined ? String(entry.value ?? "") : `(${entry.given})`;
  return { label: entry.label, type, detail, boost, info: () => card(entry) };
}

const phases = (isLua) =>
  Object.entries(PHASES).map(([phase, sentence]) => {
    const name = `sysCall_${phase}`;
    const template = isLua ? `function ${name}()\n\t\${}\nend` : `def ${name}():\n\t\${}`;
    const detail = isLua ? "function" : "def";
    return snippetCompletion(template, { label: name, type: "function", detail, info: sentence, boost: 2 });
  });

function moduleOptions(known, module) {
  const functions = [...(known.modules.get(module)?.values() ?? [])].map((entry) => option(entry, "function"));
  const constants = module === "sim" ? [...known.constants.values()].map((entry) => option(entry, "constant")) : [];
  return [...functions, ...constants];
}

function selfOptions(doc, written) {
  const names = new Set([...doc.matchAll(SELF)].map((one) => one[1]));
  if ([...doc.matchAll(new RegExp(`\\bself\\.${written}\\b`, "g"))].length < 2) names.delete(written); // its only match is the word at the cursor
  return [...names].map((label) => ({ label, type: "property" }));
}

// Complete names of objects or parameters inside a string: on request, in a call of the API, or once 3 characters match one.
function stringOptions(known, line, start, at, explicit) {
  const before = line.slice(0, start - 1);
  const written = line.slice(start);
  const isParameter = OF_PARAMETERS.test(before.slice(before.lastIndexOf("sim")));
  const names = isParameter ? known.names.parameters : known.names.objects;
  const isBegun = written.length > 2 && names.some((name) => name.startsWith(written));
  if (!names.length || !(explicit || isBegun || IN_CALL.test(before))) return null;
  const type = isParameter ? "property" : "variable";
  const detail = isParameter ? "script parameter" : "object";
  return { from: at - written.length, options: names.map((label) => ({ label, type, detail })), validFor: /^[\w#/.[\]@]*$/ };
}

function source(known, isLua) {
  return ({ state, pos, explicit }) => {
    const whole = state.doc.lineAt(pos);
    if (pos - whole.from > LONGEST_LINE) return null;
    const line = whole.text.slice(0, pos - whole.from);
    const comment = isLua ? "--" : "#";
    const start = openString(line, comment);
    if (start >= 0) return stringOptions(known, line, start, pos, explicit);
    if (openString(`${line}"`, comment) < 0) return null; // in a comment
    const dotted = /(?<![\w.])(self|sim\w*)\.(\w*)$/.exec(line);
    if (dotted) {
      const options = dotted[1] === "self" ? selfOptions(state.doc.toString(), dotted[2]) : moduleOptions(known, dotted[1]);
      return { from: pos - dotted[2].length, options, validFor: /^\w*$/ };
    }
    const word = /(?<![\w.:])[A-Za-z_]\w*$/.exec(line);
    if (!word) return null;
    const modules = [...known.modules.keys()].map((label) => ({ label, type: "namespace", boost: 1 }));
    const flat = isLua && /^sim[A-Z_]/.test(word[0]) ? [...known.flat.values()].map((one) => option(one, one.value === undefined ? "function" : "constant")) : [];
    const isFirst = !line.slice(0, word.index).replace(/\b(?:def|function)\s+$/, "").trim();
    return { from: pos - word[0].length, options: [...modules, ...flat, ...(isFirst ? phasesFor(line, word, isLua) : [])], validFor: /^\w*$/ };
  };
}

// Return the callbacks; after `def ` or `function `, each inserts only its name and parentheses.
function phasesFor(line, word, isLua) {
  const isNamed = /\b(?:def|function)\s+$/.test(line.slice(0, word.index));
  return isNamed ? phases(isLua).map(({ label, type, info, boost }) => ({ label, type, info, boost, apply: isLua ? `${label}()` : `${label}():` })) : phases(isLua);
}

function hover(known) {
  return hoverTooltip((view, pos) => {
    const { from, text } = view.state.doc.lineAt(pos);
    if (text.length > LONGEST_LINE) return null;
    for (const match of text.matchAll(/(?:(?<![\w.])(sim\w*)\s*\.\s*)?([A-Za-z_]\w*)/g)) {
      const end = from + match.index + match[0].length;
      const start = end - match[2].length;
      const entry = start <= pos && pos <= end && known.find(match[1], match[2]);
      if (entry) return { pos: start, end, above: true, create: () => ({ dom: card(entry) }) };
    }
    return null;
  });
}

// Return the editor extensions for completion and help in Lua or Python.
export function completion(known, isLua) {
  const data = (autocomplete) => EditorState.languageData.of(() => [{ autocomplete }]);
  return [data(source(known, isLua)), isLua ? data(completeAnyWord) : [], hover(known)];
}
