// The package's Markdown texts as HTML. HTML and scripts in a Markdown file are shown as text, and never run.
import MarkdownIt from "markdown-it";
import temml from "temml";
import { classHighlighter, highlightCode } from "@lezer/highlight";
import { pythonLanguage } from "@codemirror/lang-python";

const FORMULA = /\$\$([\s\S]+?)\$\$|\$(?!\s)((?:[^$\\`]|\\.)+?)(?<!\s)\$(?!\d)/y; // $$block$$ or $inline$
const STAGE = /^\/docs\/tutorial\/([0-9][^/]*\.(?:py|lua))$/;
const SOLUTION = /^\/docs\/tutorial\/(solutions\/[^/]+\.(?:py|lua))$/;
const BUILT_IN = /^\/src\/drone_sim\/child_scripts\/([^/]+\.(?:py|lua))$/;
const PICTURE = /^\/(?:docs\/pictures|tasks\/\w+)\/\w+\.png$/;

const markdown = new MarkdownIt({ html: false, highlight: highlightPython });

markdown.inline.ruler.after("escape", "formula", (state, silent) => {
  FORMULA.lastIndex = state.pos;
  const match = state.src[state.pos] === "$" && FORMULA.exec(state.src);
  if (!match) return false;
  if (!silent) Object.assign(state.push("formula", "math", 0), { content: match[1] ?? match[2], block: Boolean(match[1]) });
  state.pos += match[0].length;
  return true;
});

markdown.renderer.rules.formula = (tokens, index) =>
  temml.renderToString(tokens[index].content, { displayMode: tokens[index].block, throwOnError: false });

function highlightPython(code, language) {
  if (language !== "python") return "";
  const escape = markdown.utils.escapeHtml;
  let html = "";
  highlightCode(
    code,
    pythonLanguage.parser.parse(code),
    classHighlighter,
    (text, classes) => (html += classes ? `<span class="${classes}">${escape(text)}</span>` : escape(text)),
    () => (html += "\n"),
  );
  return html;
}

// Return the URL of a link inside the package, null if it leads outside.
function within(link, folder) {
  try {
    const url = new URL(link, `http://package/${folder}/`);
    return url.host === "package" ? url : null;
  } catch {
    return null;
  }
}

// Return the target of a link: { web }, { script }, { lesson }, or {} if the page cannot show it.
function target(href, folder) {
  if (/^https?:/i.test(href)) return { web: href };
  const url = within(href, folder);
  if (!url) return {};
  if (href.startsWith("#") || url.pathname === "/docs/tutorial.md") return { lesson: url.hash.slice(1) };
  const [stage, solution, builtIn] = [STAGE, SOLUTION, BUILT_IN].map((one) => one.exec(url.pathname)?.[1]);
  const script = (stage && `tutorial/${stage}`) || solution || (builtIn && `built-in/${builtIn}`);
  return script ? { script } : {};
}

// Put a picture into a button that shows it as large as the window.
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

// Add a row of buttons below a block of Python, one for each of `actions(code)`.
function withButtons(code, actions) {
  const row = document.createElement("p");
  row.className = "do";
  const buttons = actions(code.textContent).map(({ label, title, act }) => {
    const button = document.createElement("button");
    Object.assign(button, { textContent: label, title, onclick: act });
    return button;
  });
  row.append(...buttons);
  code.parentElement.after(row);
}

// Replace a link by its text; if the link is a whole paragraph, remove the paragraph.
function withoutLink(link) {
  const paragraph = link.closest("p");
  if (paragraph?.textContent === link.textContent && !link.firstElementChild) paragraph.remove();
  else link.replaceWith(...link.childNodes);
}

// Fill an element with a Markdown text; its links and pictures are relative to `folder`. `go(target)` follows a link inside
// the package, `knows(target)` returns whether its lesson or script exists, `actions(code)` returns buttons for a block of Python.
/** @param {(code: string) => { label: string, title: string, act: () => void }[]} [actions] */
export function render(element, text, folder, knows, go, actions = () => []) {
  element.innerHTML = markdown.render(text);
  for (const link of element.querySelectorAll("a")) {
    const to = target(link.getAttribute("href"), folder);
    if (to.web) Object.assign(link, { target: "_blank", rel: "noopener noreferrer" });
    else if ((to.lesson || to.script) && knows(to)) {
      link.href = "#";
      link.onclick = (event) => (event.preventDefault(), go(to));
    } else withoutLink(link); // its target is only in the repository
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
