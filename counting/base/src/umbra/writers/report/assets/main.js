// Which picture this study has, and its stage; tables do without either.

let stage = null, picture = null;
try {
  picture = data.kind === "plan" ? await makePlan() : await makeModel();
} catch (error) {
  $("trouble").textContent =
    "This browser cannot draw the picture (" + error.message + "). The tables and pictures below are complete.";
  $("trouble").hidden = false;
}
if (picture) stage = makeStage(picture);
dressTables(picture && picture.show ? (kind, index) => {
  stage.pick(picture.show(kind, index));
  const isCalm = matchMedia("(prefers-reduced-motion: reduce)").matches;
  $("through").scrollIntoView({ behavior: isCalm ? "auto" : "smooth", block: "start" });
} : null);
document.documentElement.dataset.ready = picture ? "yes" : "tables";
