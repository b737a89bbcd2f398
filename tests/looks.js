/* What is wrong with how a page looks, in sentences: evaluated in the page itself. */
async () => {
  await document.fonts.ready;
  const faults = [];
  const SLACK = 1.5;
  const root = document.scrollingElement;
  if (root.scrollWidth > innerWidth) faults.push(`The page is ${root.scrollWidth} px wide on a screen of ${innerWidth}.`);
  const bottom = Math.max(innerHeight, scrollY + document.body.getBoundingClientRect().bottom);
  const beyond = root.scrollHeight - bottom;
  if (beyond > SLACK) faults.push(`The page scrolls ${beyond} px into nothing.`);
  for (const image of document.images) {
    if (!image.complete || !image.naturalWidth) faults.push(`The image ${image.src} is not there.`);
  }

  const numbers = (colour) => colour.match(/[\d.]+/g).map(Number);
  const over = ([r, g, b, a = 1], below) => [r, g, b].map((value, place) => value * a + below[place] * (1 - a));
  const luminance = (colour) => {
    const [r, g, b] = colour.map((value) => {
      const share = value / 255;
      return share <= 0.04045 ? share / 12.92 : ((share + 0.055) / 1.055) ** 2.4;
    });
    return 0.2126 * r + 0.7152 * g + 0.0722 * b;
  };
  const chain = (element) => {
    const found = [];
    for (let at = element; at; at = at.parentElement) found.push(at);
    return found;
  };
  const behind = (element) =>
    chain(element)
      .reverse()
      .reduce((below, at) => over(numbers(getComputedStyle(at).backgroundColor), below), [255, 255, 255]);
  const contrast = (element, style) => {
    const below = behind(element);
    const [r, g, b, a = 1] = numbers(element instanceof SVGElement ? style.fill : style.color);
    const seen = chain(element).reduce((share, at) => share * Number(getComputedStyle(at).opacity), a);
    const [high, low] = [luminance(over([r, g, b, seen], below)), luminance(below)].sort((x, y) => y - x);
    return (high + 0.05) / (low + 0.05);
  };
  const least = (style) => {
    const size = parseFloat(style.fontSize);
    return size >= 24 || (size >= 18.66 && Number(style.fontWeight) >= 700) ? 3 : 4.5;
  };

  /** The part of a box that the screen and what it stands in let one see, and what cuts it off. */
  const clipped = (box, element) => {
    let { left, right, top, bottom } = box;
    let cut = "";
    for (const at of chain(element)) {
      const style = getComputedStyle(at);
      if (at === document.body || at === root || (style.overflowX === "visible" && style.overflowY === "visible")) continue;
      const edge = at.getBoundingClientRect();
      const sides = Math.max(edge.left - left, right - edge.right);
      const ends = Math.max(edge.top - top, bottom - edge.bottom);
      const hides = style.overflowY === "hidden" || style.overflowY === "clip";
      if (style.textOverflow !== "ellipsis" && sides > SLACK) cut ||= at.className || at.tagName;
      if (hides && ends > SLACK && edge.height > 1) cut ||= at.className || at.tagName;
      left = Math.max(left, edge.left);
      right = Math.min(right, edge.right);
      top = Math.max(top, edge.top);
      bottom = Math.min(bottom, edge.bottom);
    }
    if (left < -SLACK || right > innerWidth + SLACK) cut ||= "the screen";
    top = Math.max(top, 0);
    bottom = Math.min(bottom, innerHeight);
    return { left, right, top, bottom, cut, element, empty: right - left <= 1 || bottom - top <= 2 };
  };
  const isOff = (element) => Boolean(element.closest(":disabled, [aria-disabled='true']"));
  const hit = ({ left, right, top, bottom }) => document.elementFromPoint((left + right) / 2, (top + bottom) / 2);
  const related = (one, other) => one === other || one.contains(other) || other.contains(one);

  const lines = [];
  const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  for (let node = walker.nextNode(); node; node = walker.nextNode()) {
    const element = node.parentElement;
    const text = node.data.trim();
    if (!text || element.closest(".unseen, .skip, noscript") || !element.checkVisibility()) continue;
    const range = document.createRange();
    range.selectNodeContents(node);
    const boxes = [...range.getClientRects()].map((box) => clipped(box, element)).filter((box) => !box.empty);
    if (!boxes.length) continue;
    const style = getComputedStyle(element);
    const ratio = contrast(element, style);
    if (!isOff(element) && ratio < least(style)) faults.push(`"${text}" has a contrast of ${ratio.toFixed(2)}.`);
    for (const box of boxes) {
      if (box.cut) faults.push(`"${text}" is cut off by ${box.cut}.`);
      const top = hit(box);
      if (top && element instanceof HTMLElement && !related(element, top)) faults.push(`"${text}" is covered by ${top.className || top.tagName}.`);
      lines.push({ ...box, text });
    }
  }
  for (const [place, one] of lines.entries()) {
    for (const other of lines.slice(place + 1)) {
      if (one.element === other.element) continue;
      const wide = Math.min(one.right, other.right) - Math.max(one.left, other.left);
      const high = Math.min(one.bottom, other.bottom) - Math.max(one.top, other.top);
      if (wide > 2 && high > 4) faults.push(`"${one.text}" and "${other.text}" overlap.`);
    }
  }

  for (const control of document.querySelectorAll("button, input, select, textarea, a, summary")) {
    if (control.closest(".unseen, .skip") || !control.checkVisibility()) continue;
    const name = control.getAttribute("aria-label") || control.textContent.trim() || control.placeholder || control.id || control.value;
    const box = clipped(control.getBoundingClientRect(), control);
    if (box.empty) continue;
    if (box.cut) faults.push(`The control "${name}" is cut off by ${box.cut}.`);
    const top = hit(box);
    if (top && !related(control, top)) faults.push(`The control "${name}" is covered by ${top.className || top.tagName}.`);
    if (control.placeholder && !control.value) {
      const style = getComputedStyle(control, "::placeholder");
      if (contrast(control, style) < least(style)) faults.push(`The hint "${control.placeholder}" has too little contrast.`);
    }
  }
  return { faults, lines: lines.length };
}
