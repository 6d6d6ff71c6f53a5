// SPDX-License-Identifier: BSD-3-Clause
#include "app/configuration/comments.h"

#include <algorithm>
#include <regex>
#include <sstream>
#include <vector>

namespace berth {
namespace {

constexpr auto none = std::string::npos;

std::string trimmed(const std::string& text) {
  const std::size_t first = text.find_first_not_of(" \t");
  if (first == none) return {};
  return text.substr(first, text.find_last_not_of(" \t") + 1 - first);
}

/// Where the comment of a line begins; none: nowhere.
std::size_t comment_begin(const std::string& line) {
  char quote = 0;
  for (std::size_t i = 0; i < line.size(); ++i) {
    const char c = line[i];
    if (quote != 0) {
      if (c == quote) quote = 0;
    } else if (c == '#' && (i == 0 || line[i - 1] == ' ')) {
      return i;
    } else if ((c == '"' || c == '\'') &&
               (i == 0 || std::string(" [{,").find(line[i - 1]) != none)) {
      quote = c;
    }
  }
  return none;
}

class Reader {
 public:
  std::map<std::string, std::string> read(const std::string& text) {
    std::istringstream lines(text);
    std::string line;
    while (std::getline(lines, line)) take(line);
    return std::move(comments_);
  }

 private:
  struct Open {
    std::size_t indent;
    std::string path;
  };

  void take(const std::string& line) {
    const std::size_t begin = comment_begin(line);
    const std::string body = line.substr(0, begin);
    std::string comment = begin == none ? "" : trimmed(line.substr(begin + 1));
    if (body.find_first_not_of(' ') != none) {
      const std::string path = key(body, comment);
      if (path.empty() || !comments_[path].empty()) {
        last_ = none;  // of a key that is there again, in another item, the first comment counts
      } else {
        add(path, comment.empty() ? above_ : comment);
        last_ = comment.empty() ? none : begin;
        last_path_ = path;
      }
      above_.clear();
      own_ = false;
    } else if (begin == none) {
      above_.clear();
      last_ = none;
      own_ = false;
    } else if (begin == last_ && begin > 0) {
      add(last_path_, comment);
    } else {
      last_ = none;
      if (comment.rfind("SPDX", 0) == 0) own_ = true;
      if (!own_) above(line, begin, comment);
    }
  }

  /// A line that is a comment alone: prose of the next key, or a key that is commented out.
  void above(const std::string& line, std::size_t begin, const std::string& comment) {
    static const std::regex assignment("# ?( *)([a-z][a-z0-9_]*:( .*)?)$");
    std::smatch found;
    const std::string rest = line.substr(begin);
    if (!std::regex_match(rest, found, assignment)) {
      above_ += (above_.empty() ? "" : " ") + comment;
      return;
    }
    const std::string text = std::string(begin, ' ') + found[1].str() + found[2].str();
    const std::size_t inner = comment_begin(text);
    std::string description = inner == none ? above_ : trimmed(text.substr(inner + 1));
    const std::string path = key(text.substr(0, inner), description);
    if (comments_.count(path) == 0) add(path, description);
  }

  /// Follows the indentation. @return the path of the line's key; empty: it has none. Descriptions
  /// of keys within braces are removed from `comment`.
  std::string key(const std::string& body, std::string& comment) {
    static const std::regex name("([^\\s:\\[{\"'][^:{]*):( +(.*))?");
    std::size_t indent = body.find_first_not_of(' ');
    std::string text = trimmed(body);
    const auto leave = [&] {
      while (!open_.empty() && open_.back().indent >= indent) open_.pop_back();
      return open_.empty() ? "" : open_.back().path;
    };
    if (text.rfind("- ", 0) == 0) {
      // Items stand below their key, perhaps in its column.
      while (!open_.empty() && open_.back().indent > indent) open_.pop_back();
      if (open_.empty()) return {};
      const std::string list = open_.back().path;
      const std::string item =
          list.size() > 2 && list.substr(list.size() - 2) == "[]" ? list : list + "[]";
      open_.push_back({indent, item});
      text = trimmed(text.substr(2));
      indent += 2;
      if (text.rfind('{', 0) == 0) {
        of_flow(item, text, comment);
        return {};
      }
    }
    const std::string in = leave();
    std::smatch found;
    if (!std::regex_match(text, found, name)) return {};
    const std::string path = (in.empty() ? "" : in + ".") + found[1].str();
    open_.push_back({indent, path});
    const std::string value = found[3].str();
    if (value.rfind('{', 0) == 0) comment = of_flow(path, value, comment);
    return path;
  }

  /// A map in braces, whose comment may be of its keys: `{range: 4 m, dwell: 5 s}  # dwell: in a
  /// row; range: ...`. @return what is left of it.
  std::string of_flow(const std::string& path, const std::string& map, const std::string& comment) {
    std::string left;
    for (std::size_t begin = 0; begin < comment.size();) {
      const std::size_t end = std::min(comment.find("; ", begin), comment.size());
      const std::string one = comment.substr(begin, end - begin);
      begin = end + 2;
      const std::size_t colon = std::min(one.find(": "), one.size());
      const std::string name = one.substr(0, colon);
      const std::string last = name.substr(name.rfind('.') + 1);
      if (colon < one.size() && map.find(last + ":") != none) {
        add(path + "." + name, one.substr(colon + 2));
      } else {
        left += (left.empty() ? "" : "; ") + one;
      }
    }
    return left;
  }

  void add(const std::string& path, const std::string& comment) {
    std::string& all = comments_[path];
    if (!comment.empty()) all += (all.empty() ? "" : " ") + comment;
  }

  std::map<std::string, std::string> comments_;
  std::vector<Open> open_;
  std::string above_;
  bool own_ = false;         // in the file's own lines
  std::size_t last_ = none;  // column of the comment before
  std::string last_path_;
};

}  // namespace

std::map<std::string, std::string> comments_of_keys(const std::string& text) {
  return Reader().read(text);
}

}  // namespace berth
