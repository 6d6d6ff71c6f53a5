// SPDX-License-Identifier: BSD-3-Clause
#include "common/core/yaml.h"

#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/exceptions.h>
#include <yaml-cpp/parser.h>

#include <algorithm>
#include <map>
#include <set>
#include <sstream>
#include <string_view>

#include "common/core/error.h"
#include "common/core/valid_text.h"

namespace berth {

struct YamlNode::Content {
  Kind kind = Kind::nothing;
  std::string text;
  std::vector<YamlNode> items;
  std::vector<Entry> entries;
  int line = 1;
  std::size_t offset = 0;
};

YamlNode::YamlNode(Kind kind) : content_(std::make_shared<Content>()) { content_->kind = kind; }

YamlNode::YamlNode(std::string text) : YamlNode(Kind::text) { content_->text = std::move(text); }

YamlNode::Kind YamlNode::kind() const { return content_->kind; }
const std::string& YamlNode::text() const { return content_->text; }
const std::vector<YamlNode>& YamlNode::items() const { return content_->items; }
const std::vector<YamlNode::Entry>& YamlNode::entries() const { return content_->entries; }
std::size_t YamlNode::size() const { return items().size() + entries().size(); }
int YamlNode::line() const { return content_->line; }
std::size_t YamlNode::offset() const { return content_->offset; }

bool YamlNode::has(const std::string& key) const {
  return std::any_of(entries().begin(), entries().end(),
                     [&key](const Entry& entry) { return entry.first.text() == key; });
}

YamlNode YamlNode::at(const std::string& key) const {
  for (const Entry& entry : entries()) {
    if (entry.first.text() == key) return entry.second;
  }
  return YamlNode();
}

YamlNode YamlNode::placed_at(const YamlNode& place) const {
  YamlNode moved(kind());
  *moved.content_ = *content_;
  moved.content_->line = place.line();
  moved.content_->offset = place.offset();
  for (YamlNode& item : moved.content_->items) item = item.placed_at(place);
  for (Entry& entry : moved.content_->entries) {
    entry = {entry.first.placed_at(place), entry.second.placed_at(place)};
  }
  return moved;
}

void YamlNode::add(YamlNode item) { content_->items.push_back(std::move(item)); }

void YamlNode::add(YamlNode key, YamlNode value) {
  content_->entries.emplace_back(std::move(key), std::move(value));
}

void YamlNode::put(const std::string& key, YamlNode value) {
  for (Entry& entry : content_->entries) {
    if (entry.first.text() != key) continue;
    entry.second = std::move(value);
    return;
  }
  add(YamlNode(key), std::move(value));
}

bool operator==(const YamlNode& a, const YamlNode& b) {
  return a.is(b) || (a.kind() == b.kind() && a.text() == b.text() && a.items() == b.items() &&
                     a.entries() == b.entries());
}

std::string shown(const YamlNode& node) {
  switch (node.kind()) {
    case YamlNode::Kind::text:
      return "'" + node.text() + "'";
    case YamlNode::Kind::list:
      return "a list of " + std::to_string(node.size());
    case YamlNode::Kind::map:
      return "a map";
    default:
      return "nothing";
  }
}

namespace {

InputError error_at(const std::string& name, int line, const std::string& what) {
  return InputError(name + ":" + std::to_string(line) + ": " + what);
}

constexpr std::string_view byte_order_mark = "\xEF\xBB\xBF";

/// Of one well-formed character.
char32_t code_point_of(std::string_view character) {
  const auto first = static_cast<unsigned char>(character[0]);
  if (character.size() == 1) return first;
  char32_t point = first & (0xFFU >> (character.size() + 1));
  for (const char c : character.substr(1)) {
    point = point << 6U | (static_cast<unsigned char>(c) & 0x3FU);
  }
  return point;
}

bool may_stand_in_text(char32_t point) {
  if (point < 0x20) return point == '\t' || point == '\n';
  const bool control = point >= 0x7F && point < 0xA0 && point != 0x85;
  return !control && point != 0xFEFF && point != 0xFFFE && point != 0xFFFF;
}

std::string code_of(char32_t point) {
  std::ostringstream code;
  code << "U+" << std::hex << std::uppercase;
  code.width(4);
  code.fill('0');
  code << static_cast<std::uint32_t>(point);
  return code.str();
}

/// @param line of its first line
void check_characters(std::string_view text, const std::string& name, int line) {
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t size = character_length(text.substr(at));
    if (size == 0) {
      throw error_at(name, line, "found bytes that are not UTF-8; save the file as UTF-8");
    }
    const char32_t point = code_point_of(text.substr(at, size));
    if (!may_stand_in_text(point)) {
      throw error_at(name, line,
                     "found the character " + code_of(point) + ", which no text may hold" +
                         (point == 0xFEFF ? " but at its start (a byte order mark)" : ""));
    }
    if (point == '\n') ++line;
    at += size;
  }
}

std::string shown_tag(const std::string& tag) {
  constexpr std::string_view standard = "tag:yaml.org,2002:";
  return tag.starts_with(standard) ? "!!" + tag.substr(standard.size()) : tag;
}

}  // namespace

/// Makes the nodes from the parser's events. An exception ends the parser's recursion too.
class YamlTree : public YAML::EventHandler {
 public:
  explicit YamlTree(const std::string& name) : name_(name) {}

  const YamlNode& root() const { return root_; }

  void OnDocumentStart(const YAML::Mark& mark) override {
    if (documents_++ == 0) return;
    throw error(mark,
                "found a second document, expected the file to end; what follows '---', "
                "'...' or the end of the first value would not be read");
  }
  void OnDocumentEnd() override {}

  void OnNull(const YAML::Mark& mark, YAML::anchor_t anchor) override {
    take(mark, anchor, made(mark, YamlNode()));
  }

  void OnScalar(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                const std::string& value) override {
    refuse_tag(mark, tag);
    check_characters(value, name_, mark.line + 1);  // those of escapes
    // A tag of "?" is a plain scalar's.
    const bool merges = value == "<<" && tag == "?" && is_key();
    if (merges) open_.back().merge = true;
    take(mark, anchor, made(mark, YamlNode(value)));
  }

  void OnAlias(const YAML::Mark& mark, YAML::anchor_t anchor) override {
    const auto found = anchors_.find(anchor);
    if (found == anchors_.end()) {
      throw error(mark, "found an alias of the value that it stands in, which would have no end");
    }
    count(mark, found->second.nodes);
    if (static_cast<int>(open_.size()) + found->second.levels > max_yaml_levels) too_deep(mark);
    add(mark, found->second);
  }

  void OnSequenceStart(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                       YAML::EmitterStyle::value) override {
    begin(mark, tag, anchor, YamlNode::Kind::list);
  }
  void OnSequenceEnd() override { end(); }

  void OnMapStart(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                  YAML::EmitterStyle::value) override {
    begin(mark, tag, anchor, YamlNode::Kind::map);
  }
  void OnMapEnd() override { end(); }

 private:
  /// A value with all that it holds, aliases in place.
  struct Value {
    YamlNode node;
    std::size_t nodes = 1;
    int levels = 1;
  };
  /// A list or map that is being read.
  struct Open {
    Value value;
    YAML::anchor_t anchor = 0;
    std::size_t nodes_before = 0;
    bool has_key = false;
    YamlNode key;
    bool merge = false;          // the key is `<<`
    std::set<std::string> keys;  // the map's own
    std::vector<YamlNode> merged;
  };

  InputError error(const YAML::Mark& mark, const std::string& what) const {
    return error_at(name_, mark.line + 1, what);
  }

  void refuse_tag(const YAML::Mark& mark, const std::string& tag) const {
    if (tag.empty() || tag == "?" || tag == "!") return;
    throw error(mark, "found the tag '" + shown_tag(tag) + "', expected a value without a tag");
  }

  [[noreturn]] void too_deep(const YAML::Mark& mark) const {
    throw error(mark, "found more than " + std::to_string(max_yaml_levels) +
                          " levels of lists and maps in one another");
  }

  void count(const YAML::Mark& mark, std::size_t nodes) {
    nodes_ += nodes;
    if (nodes_ <= max_yaml_nodes) return;
    throw error(mark, "found more than " + std::to_string(max_yaml_nodes) +
                          " values, those that aliases stand for among them");
  }

  static YamlNode made(const YAML::Mark& mark, YamlNode node) {
    node.content_->line = mark.line + 1;
    node.content_->offset = static_cast<std::size_t>(mark.pos);
    return node;
  }

  bool is_key() const {
    return !open_.empty() && open_.back().value.node.is_map() && !open_.back().has_key;
  }

  void begin(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
             YamlNode::Kind kind) {
    refuse_tag(mark, tag);
    if (is_key()) throw error(mark, "found a list or map as a key, expected a word");
    if (static_cast<int>(open_.size()) >= max_yaml_levels) too_deep(mark);
    const std::size_t before = nodes_;
    count(mark, 1);
    Open open;
    open.value.node = made(mark, YamlNode(kind));
    open.anchor = anchor;
    open.nodes_before = before;
    open_.push_back(std::move(open));
  }

  void end() {
    Open open = std::move(open_.back());
    open_.pop_back();
    merge(open);
    open.value.nodes = nodes_ - open.nodes_before;
    if (open.anchor != 0) anchors_[open.anchor] = open.value;
    add({}, open.value);
  }

  void take(const YAML::Mark& mark, YAML::anchor_t anchor, const YamlNode& node) {
    count(mark, 1);
    if (anchor != 0) anchors_[anchor] = {node};
    add(mark, {node});
  }

  void add(const YAML::Mark& mark, const Value& value) {
    if (open_.empty()) {
      root_ = value.node;
      return;
    }
    Open& open = open_.back();
    if (is_key()) {
      take_key(mark, value.node);
      return;
    }
    open.value.levels = std::max(open.value.levels, value.levels + 1);
    if (open.value.node.is_list()) {
      open.value.node.add(value.node);
    } else if (open.merge) {
      take_merged(open, value.node);
    } else {
      open.value.node.add(open.key, value.node);
    }
    open.has_key = open.merge = false;
  }

  void take_key(const YAML::Mark& mark, const YamlNode& key) {
    if (!key.is_text()) throw error(mark, "found " + shown(key) + " as a key, expected a word");
    Open& open = open_.back();
    if (!open.keys.insert(key.text()).second) {
      throw error(mark, "key '" + key.text() + "' appears twice");
    }
    open.key = key;
    open.has_key = true;
  }

  void take_merged(Open& open, const YamlNode& value) const {
    const std::vector<YamlNode> one = {value};
    for (const YamlNode& map : value.is_list() ? value.items() : one) {
      if (!map.is_map()) {
        throw error_at(name_, open.key.line(),
                       "key '<<': found " + shown(map) + ", expected a map, or a list of maps");
      }
      open.merged.push_back(map);
    }
  }

  /// The map's own keys take precedence over merged ones, earlier maps over later ones.
  static void merge(Open& open) {
    for (const YamlNode& map : open.merged) {
      for (const YamlNode::Entry& entry : map.entries()) {
        if (!open.keys.insert(entry.first.text()).second) continue;
        open.value.node.add(entry.first, entry.second);
      }
    }
  }

  const std::string& name_;
  int documents_ = 0;
  std::size_t nodes_ = 0;
  std::vector<Open> open_;
  std::map<YAML::anchor_t, Value> anchors_;
  YamlNode root_;
};

std::string clean_text(const std::string& bytes, const std::string& name) {
  for (const std::string_view mark : {"\xFF\xFE", "\xFE\xFF"}) {
    if (!bytes.starts_with(mark)) continue;
    throw error_at(name, 1, "found UTF-16 or UTF-32, expected UTF-8; save the file as UTF-8");
  }
  std::string text;
  text.reserve(bytes.size());
  for (std::size_t i = bytes.starts_with(byte_order_mark) ? 3 : 0; i < bytes.size(); ++i) {
    if (bytes[i] != '\r') {
      text += bytes[i];
    } else if (i + 1 == bytes.size() || bytes[i + 1] != '\n') {
      text += '\n';
    }
  }
  check_characters(text, name, 1);
  return text;
}

YamlNode read_yaml(const std::string& bytes, const std::string& name) {
  YamlTree tree(name);
  std::istringstream in(clean_text(bytes, name));
  try {
    YAML::Parser parser(in);
    while (parser.HandleNextDocument(tree)) continue;
  } catch (const YAML::Exception& e) {
    throw error_at(name, std::max(e.mark.line + 1, 1), "not YAML: " + e.msg);
  }
  return tree.root();
}

namespace fs = std::filesystem;

std::vector<fs::path> yaml_files(const fs::path& directory) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::recursive_directory_iterator(directory)) {
    if (entry.is_regular_file() && entry.path().extension() == ".yaml") {
      files.push_back(entry.path());
    }
  }
  std::sort(files.begin(), files.end());
  return files;
}

}  // namespace berth
