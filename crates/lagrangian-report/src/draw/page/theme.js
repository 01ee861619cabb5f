(() => {
  "use strict";
  const root = document.documentElement;
  const system = matchMedia("(prefers-color-scheme: dark)");
  const wanted = () => {
    const hash = location.hash.slice(1);
    return hash === "dark" || hash === "light" ? hash : null;
  };
  const apply = (theme) => {
    if (theme) root.dataset.theme = theme;
    root.dispatchEvent(new Event("themechange"));
  };
  apply(wanted());
  addEventListener("hashchange", () => apply(wanted()));
  system.addEventListener("change", () => apply(null));
  addEventListener("DOMContentLoaded", () => {
    document.querySelector(".theme").addEventListener("click", () => {
      const dark = root.dataset.theme ? root.dataset.theme === "dark" : system.matches;
      apply(dark ? "light" : "dark");
    });
    for (const button of document.querySelectorAll(".line button")) {
      button.addEventListener("click", async () => {
        const line = button.parentElement.querySelector("pre");
        try {
          await navigator.clipboard.writeText(line.textContent);
        } catch {
          getSelection().selectAllChildren(line);
          return;
        }
        button.textContent = "Copied";
        setTimeout(() => { button.textContent = "Copy"; }, 1500);
      });
    }
  });
})();
