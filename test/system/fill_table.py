#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""fill_table.py DOCUMENT NAME TABLE: puts the file TABLE between '<!-- NAME -->' and '<!-- end -->' of DOCUMENT."""
import re
import sys

document, name, table = sys.argv[1:]
with open(document) as file:
    text = file.read()
with open(table) as file:
    rows = file.read().rstrip("\n")
place = re.compile(rf"(<!-- {name} -->\n).*?(<!-- end -->)", re.S)
if not place.search(text):
    sys.exit(f"{document}: no place for '{name}'")
with open(document, "w") as file:
    file.write(place.sub(lambda found: found[1] + rows + "\n" + found[2], text, count=1))
