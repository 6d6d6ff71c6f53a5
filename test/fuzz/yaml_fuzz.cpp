// SPDX-License-Identifier: BSD-3-Clause
// The reader of all YAML files, and the parameters of procedures.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>

#include "common/core/config.h"
#include "common/core/error.h"
#include "common/core/yaml_text.h"
#include "procedures/language/parameters.h"

using namespace berth;

namespace {

void expect(bool holds) {
  if (!holds) std::abort();
}

/// Calls, and takes the complaint for an answer.
template <class Call>
void may_complain(const Call& call) {
  try {
    call();
  } catch (const InputError&) {
  }
}

void read_values(Config config) {
  for (const std::string& key : config.keys()) {
    may_complain([&] { config.integer(key); });
    may_complain([&] { config.small_integer(key); });
    may_complain([&] { config.integers(key); });
    may_complain([&] { config.boolean(key); });
    may_complain([&] { config.quantity(key, Dimension::length); });
    may_complain([&] { config.pose(key); });
    may_complain([&] { config.texts(key); });
    may_complain([&] { read_values(config.section(key)); });
    may_complain([&] {
      for (const Config& section : config.sections(key)) read_values(section);
    });
  }
  may_complain([&] { config.finish(); });
}

/// What is written reads as what it was written of.
void read_and_write(const std::string& text) {
  const YamlNode root = read_yaml(text, "fuzz");
  expect(read_yaml(flow_text(root), "flow") == root);
  if (!root.is_map()) return;
  if (root.size() > 0) expect(read_yaml(written(root), "block") == root);
  read_values(Config(root, "fuzz"));
}

void fill_in(const std::string& text, const procedures::Overrides& overrides) {
  const auto written = procedures::read_written(text, "fuzz");
  const auto filled = procedures::apply_parameters(written, "fuzz", overrides, {"swept", "s"});
  expect(read_yaml(filled.text, "filled") == filled.tree);
  may_complain([&] { procedures::refuse_open_references(filled.tree, "fuzz"); });
  const YamlNode value("it's: #1");
  may_complain([&] {
    const YamlNode done = procedures::fill(filled.tree, {{"swept", value}, {"s", filled.tree}});
    procedures::refuse_open_references(done, "fuzz");
  });
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  may_complain([&] { read_and_write(text); });
  may_complain([&] { fill_in(text, {}); });
  // The first line is a value for the parameter `p`.
  const std::size_t line = text.find('\n');
  if (line == std::string::npos) return 0;
  may_complain([&] { fill_in(text.substr(line + 1), {{"p", text.substr(0, line)}}); });
  return 0;
}
