// What the page knows better than the browser's own types.

// Every element that it looks for is one of HTML's.
interface ParentNode {
  querySelector<Name extends keyof HTMLElementTagNameMap>(selectors: Name): HTMLElementTagNameMap[Name] | null;
  querySelector(selectors: string): HTMLElement | null;
  querySelectorAll<Name extends keyof HTMLElementTagNameMap>(selectors: Name): NodeListOf<HTMLElementTagNameMap[Name]>;
  querySelectorAll(selectors: string): NodeListOf<HTMLElement>;
}

interface HTMLElement {
  readonly children: HTMLCollectionOf<HTMLElement>;
  readonly firstElementChild: HTMLElement | null;
}

interface Document {
  readonly activeElement: HTMLElement | null;
}

// Elements have it; window and document, which get keys and pastes, too, do not.
interface EventTarget {
  closest?(selectors: string): Element | null;
}

// The fields of *Tune*, which the page makes, by their ids.
interface PageElements {
  [field: `tune ${string}`]: HTMLInputElement | null;
}

// Only Chromium's; without it there is none.
interface Navigator {
  keyboard?: { getLayoutMap?: () => Promise<Map<string, string>> };
}

interface Window {
  scene: import("../src/scene/scene.js").Scene;
}
