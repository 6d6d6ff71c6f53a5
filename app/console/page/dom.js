// SPDX-License-Identifier: BSD-3-Clause
// Functions of the document that the parts of the page share.

export const $ = (id) => document.getElementById(id);

/// make('li', {class: 'x', 'data-state': 'y', title: 'z'}, child, 'text', ...)
export function make(tag, attributes = {}, ...children) {
  const element = document.createElement(tag);
  for (const [key, value] of Object.entries(attributes)) {
    if (value !== undefined && value !== null) element.setAttribute(key, value);
  }
  element.append(...children.filter((child) => child !== null && child !== undefined));
  return element;
}

/// Sets text only where it differs: no needless layout, no needless announcement.
export function setText(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

export function setData(element, key, value) {
  if (element.dataset[key] !== String(value)) element.dataset[key] = value;
}

/// Keeps the children of `list` one per item, made once by `create(item)` and brought up to date
/// by `update(element, item, index)`; `keyOf` distinguishes items.
export function keepList(list, items, keyOf, create, update) {
  const known = new Map(Array.from(list.children, (child) => [child.dataset.key, child]));
  let place = list.firstElementChild;
  items.forEach((item, index) => {
    const key = String(keyOf(item, index));
    let child = known.get(key);
    if (child)
      known.delete(key);
    else
      (child = create(item)).dataset.key = key;
    update(child, item, index);
    if (child === place)
      place = place.nextElementSibling;
    else
      list.insertBefore(child, place);
  });
  for (const child of known.values()) child.remove();
}

/// Scrolls `list` so far that `child` is seen, and nothing but `list`.
export function scrollTo(list, child) {
  const above = child.offsetTop - list.offsetTop;
  if (above < list.scrollTop || above + child.offsetHeight > list.scrollTop + list.clientHeight) {
    list.scrollTop = Math.max(0, above - list.clientHeight / 2);
  }
}
