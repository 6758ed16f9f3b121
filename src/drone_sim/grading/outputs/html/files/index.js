// Sort the table of scripts after a click on a heading.
"use strict";

const table = document.getElementById("scripts");
const headings = [...table.querySelectorAll("th")];

function sort(column) {
  const heading = headings[column];
  const isNumber = heading.dataset.sort === "number";
  const way = heading.getAttribute("aria-sort") === "ascending" ? "descending" : "ascending";
  const value = (row) => row.cells[column].dataset.value;
  const compare = (a, b) => (isNumber ? value(a) - value(b) : value(a).localeCompare(value(b)));
  const rows = [...table.tBodies[0].rows].sort((a, b) => (way === "ascending" ? compare(a, b) : compare(b, a)));
  for (const one of headings) one.removeAttribute("aria-sort");
  heading.setAttribute("aria-sort", way);
  table.tBodies[0].append(...rows);
}

headings.forEach((heading, column) => heading.dataset.sort && heading.addEventListener("click", () => sort(column)));
