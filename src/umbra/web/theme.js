// Light or dark: as the page's host says, or else as the system asks.

/** Whether the page that an element is in is dark. */
const isDark = () => {
  const { body, documentElement: html } = document,
    jupyter = body.dataset.jpThemeLight, // JupyterLab, Notebook 7
    code = body.dataset.vscodeThemeKind,
    colab = html.getAttribute("theme");
  if (jupyter !== undefined) return jupyter === "false";
  if (code !== undefined) return !code.endsWith("light");
  if (colab !== null) return colab === "dark";
  return matchMedia("(prefers-color-scheme: dark)").matches;
};

/**
 * Keep an element's `data-theme` as its host's.
 * @param {HTMLElement} root
 * @returns {() => void} what ends it
 */
export const followTheme = (root) => {
  const follow = () => {
    root.dataset.theme = isDark() ? "dark" : "light";
  };
  const watch = new MutationObserver(follow),
    scheme = matchMedia("(prefers-color-scheme: dark)");
  for (const element of [document.body, document.documentElement])
    watch.observe(element, {
      attributes: true,
      attributeFilter: ["data-jp-theme-light", "data-vscode-theme-kind", "theme"],
    });
  scheme.addEventListener("change", follow);
  follow();
  return () => {
    watch.disconnect();
    scheme.removeEventListener("change", follow);
  };
};
