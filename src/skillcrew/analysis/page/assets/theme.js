"use strict";
// Light or dark: as the system has it, until somebody chooses.

/** Lets a button switch; `redraw` is called where what is drawn does not follow by itself. Returns the switch. */
function followTheme(redraw) {
  function setTheme(theme) {
    document.documentElement.dataset.theme = theme;
    byId("theme").textContent = theme === "dark" ? "Light" : "Dark";
    redraw();
  }
  const otherTheme = () => setTheme(isDark() ? "light" : "dark");
  byId("theme").addEventListener("click", otherTheme);
  const dark = window.matchMedia("(prefers-color-scheme: dark)");
  dark.addEventListener("change", (event) => setTheme(event.matches ? "dark" : "light"));
  setTheme(dark.matches ? "dark" : "light");
  return otherTheme;
}
