#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Reports in headless Chromium: nothing said on the console, every chart brought to life, hover, zoom and legends
# work, nothing wider than a narrow window, something drawn in light and in dark.
. "$(dirname "$0")/common.sh"

"$bin/berth" run --twin --seed 3 --out "$work/a" procedures/track_static.yaml >/dev/null || true
"$bin/berth" run --twin --seed 4 --out "$work/b" procedures/track_static.yaml >/dev/null || true
run=$(only_run "$work/a")
"$bin/berth" report "$run" "$(only_run "$work/b")" --html "$work/both.html" >/dev/null || true

# What a reader does, done by a script in a copy of the page; its findings come out as attributes of the body.
cat >"$work/reader.html" <<'END'
<script>
Element.prototype.setPointerCapture = () => {};  // pointers made by a script cannot be captured
const body = document.body;
body.dataset.wide = String(document.documentElement.scrollWidth > innerWidth + 1);
const figure = document.querySelector('figure.chart');
const area = figure.querySelector('.area');
const svg = figure.querySelector('svg');
const box = area.getBoundingClientRect();
const point = (name, part) => area.dispatchEvent(new PointerEvent(name, {bubbles: true, button: 0, pointerType: 'mouse',
  clientX: box.left + part * box.width, clientY: box.top + box.height / 2}));
point('pointermove', 0.5);
body.dataset.hover = String(!document.getElementById('tip').hidden && document.getElementById('tip').textContent.length > 3);
point('pointerdown', 0.4); point('pointermove', 0.5); point('pointerup', 0.6);
const zoomed = svg.getAttribute('viewBox');
body.dataset.zoom = String(zoomed !== '0 0 1000 1000' && !zoomed.includes('NaN'));
area.dispatchEvent(new MouseEvent('dblclick', {bubbles: true}));
body.dataset.back = String(svg.getAttribute('viewBox') === '0 0 1000 1000');
const key = figure.querySelector('.key');
key.click();
body.dataset.legend = String(svg.querySelector(`path[data-curve="${key.dataset.curve}"]`).style.display === 'none');
body.dataset.done = 'true';
</script>
END

browse() { chromium --headless --no-sandbox --disable-gpu --user-data-dir="$work/profile" --virtual-time-budget=3000 "$@"; }

for page in "$run/report.html" "$work/both.html"; do
  cat "$page" "$work/reader.html" >"$work/read.html"
  for width in 1280 420; do
    browse --enable-logging=stderr --window-size=$width,900 --dump-dom "file://$work/read.html" >"$work/dom.html" 2>"$work/console.txt"
    ! grep 'CONSOLE' "$work/console.txt" || fail "the console of $page is not silent"
    charts=$(grep -o 'data-charts="[0-9]*"' "$work/dom.html" | head -1 | tr -dc 0-9)
    [ "${charts:-0}" -ge 5 ] || fail "$page: only ${charts:-0} charts came to life"
    for what in hover zoom back legend done; do
      grep -q "data-$what=\"true\"" "$work/dom.html" || fail "$page at $width: $what does not work"
    done
    grep -q 'data-wide="false"' "$work/dom.html" || fail "$page at $width: wider than its window"
  done
done
for colours in light dark; do
  flags=()
  [ $colours = light ] || flags=(--force-dark-mode --enable-features=WebContentsForceDark)
  browse --window-size=1280,2000 --screenshot="$work/$colours.png" "${flags[@]}" "file://$run/report.html" 2>/dev/null
  [ "$(stat -c %s "$work/$colours.png")" -gt 50000 ] || fail "next to nothing is drawn in $colours"
done
! cmp -s "$work/light.png" "$work/dark.png" || fail "light and dark look the same"
echo "reports open in Chromium"
