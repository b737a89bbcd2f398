/**
 * Keys that an input method (IME) uses to compose words: they are the field's alone, so that none
 * sends half-typed words or closes a panel. Loaded first, this hears them before all others.
 *
 * Safari ends a composition before its last key, and marks that only by the key code 229.
 */
window.addEventListener(
  "keydown",
  (event) => {
    if (!event.isComposing && event.keyCode !== 229) return;
    event.stopImmediatePropagation();
    if (event.key === "Enter") event.preventDefault(); // it would submit the form of a field of one line
  },
  { capture: true },
);
