// Texts of the package as HTML: whatever stands in a file is text; no HTML of its own, and no script, comes from there.
import MarkdownIt from "markdown-it";
import temml from "temml";
import { classHighlighter, highlightCode } from "@lezer/highlight";
import { pythonLanguage } from "@codemirror/lang-python";

const FORMULA = /\$\$([\s\S]+?)\$\$|\$(?!\s)((?:[^$\\`]|\\.)+?)(?<!\s)\$(?!\d)/y; // $$on a line of its own$$, $in a line$
const STAGE = /^\/docs\/tutorial\/([0-9][^/]*\.(?:py|lua))$/;
const SOLUTION = /^\/docs\/tutorial\/(solutions\/[^/]+\.(?:py|lua))$/;
const BUILT_IN = /^\/src\/drone_sim\/child_scripts\/([^/]+\.(?:py|lua))$/;
const PICTURE = /^\/(?:docs\/pictures|tasks\/\w+)\/\w+\.png$/;

const markdown = new MarkdownIt({ html: false, highlight: coloured });

markdown.inline.ruler.after("escape", "formula", (state, silent) => {
  FORMULA.lastIndex = state.pos;
  const found = state.src[state.pos] === "$" && FORMULA.exec(state.src);
  if (!found) return false;
  if (!silent) Object.assign(state.push("formula", "math", 0), { content: found[1] ?? found[2], block: Boolean(found[1]) });
  state.pos += found[0].length;
  return true;
});

markdown.renderer.rules.formula = (tokens, index) =>
  temml.renderToString(tokens[index].content, { displayMode: tokens[index].block, throwOnError: false });

function coloured(code, language) {
  if (language !== "python") return "";
  const escape = markdown.utils.escapeHtml;
  let made = "";
  highlightCode(
    code,
    pythonLanguage.parser.parse(code),
    classHighlighter,
    (text, classes) => (made += classes ? `<span class="${classes}">${escape(text)}</span>` : escape(text)),
    () => (made += "\n"),
  );
  return made;
}

// The place of a link in the package, null for what is not in it.
function within(link, folder) {
  try {
    const url = new URL(link, `http://package/${folder}/`);
    return url.host === "package" ? url : null;
  } catch {
    return null;
  }
}

// Where a link of a text leads: out into the web, to a script of ours, to another text, or nowhere.
function target(href, folder) {
  if (/^https?:/i.test(href)) return { web: href };
  const url = within(href, folder);
  if (!url) return {};
  if (href.startsWith("#") || url.pathname === "/docs/tutorial.md") return { lesson: url.hash.slice(1) };
  const [stage, solution, builtIn] = [STAGE, SOLUTION, BUILT_IN].map((one) => one.exec(url.pathname)?.[1]);
  const script = (stage && `tutorial/${stage}`) || solution || (builtIn && `built-in/${builtIn}`);
  return script ? { script } : {};
}

// A picture that a click, or Enter, shows as large as the window is.
function enlargeable(picture) {
  const button = document.createElement("button");
  button.className = "enlarge";
  button.title = "Click to enlarge";
  button.setAttribute("aria-label", `Enlarge: ${picture.alt}`);
  button.onclick = () => enlarge(picture);
  picture.replaceWith(button);
  button.append(picture);
}

function enlarge({ src, alt }) {
  const dialog = document.createElement("dialog");
  dialog.className = "enlarged";
  dialog.setAttribute("aria-label", alt);
  const close = document.createElement("button");
  close.textContent = "×";
  close.setAttribute("aria-label", "Close");
  dialog.append(close, Object.assign(new Image(), { src, alt }));
  dialog.onclick = () => dialog.close();
  dialog.onclose = () => dialog.remove();
  document.body.append(dialog);
  dialog.showModal();
}

// What can be done with a block of Python: a row of buttons below it, one for each of `actions(code)`.
function withButtons(code, actions) {
  const row = document.createElement("p");
  row.className = "do";
  const made = actions(code.textContent).map(({ label, title, act }) => {
    const button = document.createElement("button");
    Object.assign(button, { textContent: label, title, onclick: act });
    return button;
  });
  row.append(...made);
  code.parentElement.after(row);
}

// A paragraph that is nothing but the link goes with it.
function withoutLink(link) {
  const paragraph = link.closest("p");
  if (paragraph?.textContent === link.textContent && !link.firstElementChild) paragraph.remove();
  else link.replaceWith(...link.childNodes);
}

// Fills an element with a text whose links and pictures are seen from `folder`; `go` follows a link that is ours.
// `knows` tells whether there is such a text or script; `actions` returns { label, title, act } for a block of Python.
/** @param {(code: string) => { label: string, title: string, act: () => void }[]} [actions] */
export function render(element, text, folder, knows, go, actions = () => []) {
  element.innerHTML = markdown.render(text);
  for (const link of element.querySelectorAll("a")) {
    const to = target(link.getAttribute("href"), folder);
    if (to.web) Object.assign(link, { target: "_blank", rel: "noopener noreferrer" });
    else if ((to.lesson || to.script) && knows(to)) {
      link.href = "#";
      link.onclick = (event) => (event.preventDefault(), go(to));
    } else withoutLink(link); // it leads to what is only in the repository
  }
  for (const picture of element.querySelectorAll("img")) {
    const path = within(picture.getAttribute("src"), folder)?.pathname;
    if (path && PICTURE.test(path)) {
      picture.src = path.slice(1); // relative to the page, which may lie below a prefix
      enlargeable(picture);
    } else picture.replaceWith(picture.alt);
  }
  for (const code of element.querySelectorAll("pre > code.language-python")) withButtons(code, actions);
}
