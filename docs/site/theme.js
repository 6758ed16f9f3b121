// Furo does this by a script within the page, which the cockpit's policy does not let run.
document.addEventListener("DOMContentLoaded", () => {
  document.body.dataset.theme ||= localStorage.getItem("theme") || "auto";
});
