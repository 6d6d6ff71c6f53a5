// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/report/page.h"

#include "common/core/file.h"
#include "evaluation/report/page_files.h"

namespace berth::report {

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
             // Opened from a disk or a mail: a page from a log must not reach anywhere.
             "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; "
             "style-src 'unsafe-inline'; script-src 'unsafe-inline'; img-src data:\">\n<title>") +
         text(title_) + markup("</title>\n<style>\n" + std::string(page_style) + "</style>") +
         markup("</head>\n<body><header>\n") + head_ + markup("</header>\n<nav>") + contents_ +
         markup("</nav>\n<main>\n") + sections_ +
         markup("</main>\n<script>\n" + std::string(page_script) + "</script></body></html>\n");
}

void Page::write(const std::filesystem::path& file) const { write_file(file, html().code); }

}  // namespace berth::report
