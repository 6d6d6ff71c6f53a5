// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/report/heat_map.h"

namespace berth::report {

Html html_of(const HeatMap& map, const ColourScale& scale) {
  Html html = markup("<figure class=\"heat\"><figcaption><b>") + text(map.title) + markup("</b> ") +
              scale.legend() + markup("</figcaption><div class=\"scroll\"><table>\n<caption>") +
              text(map.y_name) + markup("</caption><tbody>\n");
  for (std::size_t row = map.cells.size(); row-- > 0;) {
    html += markup("<tr><th>") + text(map.y_labels[row]) + markup("</th>");
    for (const HeatMap::Cell& cell : map.cells[row]) {
      html += markup("<td class=\"" + scale.class_of(cell.value) + "\" title=\"") +
              text(cell.hover) + markup("\">") + text(cell.shown) + markup("</td>");
    }
    html += markup("</tr>\n");
  }
  html += markup("</tbody><tfoot><tr><th></th>");
  for (const std::string& label : map.x_labels) html += element("th", "", text(label));
  return html +
         markup("</tr><tr><th></th><th class=\"name\" colspan=\"" +
                std::to_string(map.x_labels.size()) + "\">") +
         text(map.x_name) + markup("</th></tr></tfoot></table></div></figure>\n");
}

}  // namespace berth::report
