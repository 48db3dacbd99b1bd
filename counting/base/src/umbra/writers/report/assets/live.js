// The live model: made when it is asked for, as it takes a moment and a graphics card.

$("live-show")?.addEventListener("click", async () => {
  const block = decode($("live-block").textContent);
  $("live-show").parentElement.remove();
  $("live").hidden = false;
  const app = await kit.mount($("live"), block, JSON.parse($("live-config").textContent));
  $("live").dataset.ready = app ? "yes" : "no";
  app?.stage.canvas.focus({ preventScroll: true });
});
