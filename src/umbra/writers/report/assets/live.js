// The live model: made when it is asked for, as it takes a moment and a graphics card.

$("live-show")?.addEventListener("click", async () => {
  const block = Uint8Array.from(atob($("live-block").textContent.trim()), (letter) => letter.charCodeAt(0));
  $("live-show").parentElement.remove();
  $("live").hidden = false;
  const app = await mountLive($("live"), block, JSON.parse($("live-config").textContent));
  $("live").dataset.ready = app ? "yes" : "no";
  app?.stage.canvas.focus({ preventScroll: true });
});
