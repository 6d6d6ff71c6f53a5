// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/report/html.h"

#include <algorithm>
#include <cctype>
#include <cstdio>

#include "common/core/file.h"
#include "common/core/text.h"

namespace berth::report {

std::string style_along(double from, double to) {
  const double begin = std::clamp(from, 0.0, 1.0);
  const double end = std::clamp(to, 0.0, 1.0);
  return "left:" + fixed(100 * begin, 2) + "%;width:" + fixed(100 * (end - begin), 2) + "%";
}

Html link(std::string_view relative_path, const Html& content) {
  // A first segment with a colon would be read as a scheme.
  std::string address = "./";
  for (const char c : relative_path) {
    const auto byte = static_cast<unsigned char>(c);
    if (std::isalnum(byte) != 0 || std::string_view("-._~/").find(c) != std::string_view::npos) {
      address += c;
    } else {
      char hex[4];
      std::snprintf(hex, sizeof hex, "%%%02X", byte);
      address += hex;
    }
  }
  return {"<a href=\"" + address + "\">" + content.code + "</a>"};
}

namespace {

const char* class_of(Table::Status status) {
  return status == Table::passed ? "good" : status == Table::failed ? "bad" : "unsure";
}

Html content_of(const Table::Cell& cell) {
  const Html content = cell.drawing.empty() ? text(cell.text) : cell.drawing;
  return cell.link.empty() ? content : link(cell.link, content);
}

}  // namespace

Html html_of(const Table& table) {
  const auto in = [&table](const char* tag, std::size_t column, const Html& content) {
    const bool left = column < table.alignment.size() && table.alignment[column] == 'l';
    return element(tag, left ? "l" : "", content);
  };
  Html html = markup("<div class=\"scroll\"><table><thead><tr>");
  std::size_t column = 0;
  for (const std::string& heading : table.headings()) html += in("th", column++, text(heading));
  html += markup("</tr></thead><tbody>\n");
  for (const Table::Row& row : table.rows) {
    html += markup("<tr>");
    column = 0;
    for (const Table::Cell& cell : table.shown(row)) {
      const bool coloured = column == 0 && row.status != Table::none;
      const Html content = content_of(cell);
      html += in("td", column++, coloured ? element("b", class_of(row.status), content) : content);
    }
    html += markup("</tr>\n");
  }
  html += markup("</tbody></table></div>\n");
  for (const Table::Row& row : table.rows) {
    if (!row.note.empty()) html += element("p", "soft", text(row.name + ": " + row.note));
  }
  return html;
}

void Page::section(const std::string& id, const std::string& heading, const Html& content) {
  const Html name = text(heading);
  contents_ += markup("<a href=\"#" + id + "\">") + name + markup("</a> ");
  sections_ += markup("<section id=\"" + id + "\"><h2>") + name + markup("</h2>\n") + content +
               markup("</section>\n");
}

Html Page::html() const {
  return markup(
             "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\n"
             "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
             "<meta name=\"generator\" content=\"berth\">\n"
             // For pages opened from a disk or a mail: content of a log must not load anything.
             "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; "
             "style-src 'unsafe-inline'; script-src 'unsafe-inline'; img-src data:\">\n<title>") +
         text(title_) + markup("</title>\n<style>\n" + std::string(page_style) + "</style>") +
         markup("</head>\n<body><header>\n") + head_ + markup("</header>\n<nav>") + contents_ +
         markup("</nav>\n<main>\n") + sections_ +
         markup("</main>\n<script>\n" + std::string(page_script) + "</script></body></html>\n");
}

void Page::write(const std::filesystem::path& file) const { write_file(file, html().code); }

}  // namespace berth::report
