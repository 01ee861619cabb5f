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
  // What is folded is printed all the same.
  let folded = [];
  addEventListener("beforeprint", () => {
    folded = [...document.querySelectorAll("details:not([open], .save)")];
    for (const one of folded) one.open = true;
  });
  addEventListener("afterprint", () => { for (const one of folded) one.open = false; });
  addEventListener("DOMContentLoaded", () => {
    // A section that is asked for is unfolded.
    const unfold = () => { const section = document.getElementById(location.hash.slice(1)); if (section?.matches("details")) section.open = true; };
    addEventListener("hashchange", unfold);
    unfold();
    for (const link of document.querySelectorAll(".contents a")) {
      link.addEventListener("click", () => { document.getElementById(link.hash.slice(1)).open = true; });
    }
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
