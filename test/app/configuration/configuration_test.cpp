// SPDX-License-Identifier: BSD-3-Clause
#include <cstdlib>
#include <nlohmann/json.hpp>

#include "app/configuration/comments.h"
#include "app/configuration/described_keys.h"
#include "common/core/error.h"
#include "common/core/file.h"
#include "test/catch.h"

using namespace berth;
using Catch::Contains;

namespace {

/// The file agrees with its readers; it is rewritten when BERTH_RENEW is set.
void in_step(const std::string& file, const std::string& expected) {
  INFO("BERTH_RENEW=1 ./berth test -R test_configuration writes " + file + " anew");
  if (std::getenv("BERTH_RENEW") != nullptr) write_file(file, expected);
  const bool same = std::filesystem::exists(file) && read_file(file) == expected;
  CHECK(same);
}

/// The document with other text between its marks.
std::string filled(const std::string& document, const std::string& text) {
  const std::string begin = "<!-- keys -->\n", end = "<!-- end -->\n";
  const std::size_t from = document.find(begin) + begin.size();
  return document.substr(0, from) + text + document.substr(document.find(end, from));
}

const DescribedKey* find(const std::vector<DescribedKey>& keys, const std::string& path) {
  for (const DescribedKey& one : keys) {
    if (one.key.path == path) return &one;
  }
  return nullptr;
}

}  // namespace

TEST_CASE("Comments are found next to keys, below, above, and of keys that are commented out") {
  const auto comments = comments_of_keys(
      "# SPDX-License-Identifier: none\n"
      "# The file's own.\n"
      "first: 1\n"
      "second: '#2'   # beside\n"
      "               # and below\n"
      "\n"
      "# Above.\n"
      "map:\n"
      "  inner: 3     # in it\n"
      "  # left_out: 4   # of nobody\n"
      "list:\n"
      "  - name: a    # of an item\n"
      "    size: 2\n"
      "points:\n"
      "  - {range: 4 m, dwell: 5 s}   # dwell: in a row\n"
      "last: {low: 1, high: 2}   # both\n");
  CHECK(comments.at("first").empty());
  CHECK(comments.at("second") == "beside and below");
  CHECK(comments.at("map") == "Above.");
  CHECK(comments.at("map.inner") == "in it");
  CHECK(comments.at("map.left_out") == "of nobody");
  CHECK(comments.at("list[].name") == "of an item");
  CHECK(comments.at("list[].size").empty());
  CHECK(comments.at("points[].dwell") == "in a row");
  CHECK(comments.at("last") == "both");
}

TEST_CASE("A file's kind is known by its name and folder") {
  CHECK(kind_of_file("config/lidars/ilris_3d.yaml").name == "lidar");
  CHECK(kind_of_file("/srv/site/config/estimator_ours.yaml").name == "estimator");
  CHECK(kind_of_file("config/registers/plc.yaml").name == "plc");
  CHECK(kind_of_file("config/registers/snpx.yaml").name == "registers");
  CHECK(kind_of_file("targets/relay/target.yaml").name == "target");
  CHECK_THROWS_WITH(kind_of_file("config/estimators/what.yaml"), Contains("what.yaml"));
  CHECK_THROWS_WITH(config_kind("lidra"), Contains("'lidra'") && Contains("lidar"));
}

TEST_CASE("Keys are described by the call that reads them and the shipped files' comments") {
  const auto keys = described_keys(config_kind("estimator"), "config/estimator_paper.yaml");
  const DescribedKey* gate = find(keys, "tracking.icp.min_gate");
  REQUIRE(gate != nullptr);
  CHECK(gate->key.default_value == "35 mm");
  CHECK(gate->key.value == "35 mm");
  CHECK(text_of(gate->key.bounds, gate->key.dimension) == "at least 1 mm");
  CHECK(gate->meaning == "and at last");
  const DescribedKey* port = find(keys, "ranges.docking_port");  // no shipped file has it
  REQUIRE(port != nullptr);
  CHECK_FALSE(port->meaning.empty());
  CHECK(find(keys, "lidar")->key.required);
  CHECK_FALSE(find(keys, "noise")->key.required);

  const auto guidance = described_keys(config_kind("guidance"));
  CHECK_FALSE(find(guidance, "orbit")->key.required);  // of one law alone
  CHECK(find(guidance, "orbit.altitude")->key.required);
  const Table table = key_table(guidance, false);
  CHECK(json_table(table).front().dump() ==
        R"({"key":"law","kind":"word","default":"required",)"
        R"("allowed":"kinematic, clohessy_wiltshire",)"
        R"("meaning":"or clohessy_wiltshire, with orbit and vehicle"})");
}

TEST_CASE("Every kind has files, and every value in them a meaning") {
  for (const ConfigKind& kind : config_kinds()) {
    INFO(kind.name);
    CHECK_FALSE(shipped_files(kind).empty());
    for (const DescribedKey& one : described_keys(kind)) {
      if (one.key.kind == ConfigKey::Kind::map || one.key.kind == ConfigKey::Kind::maps) continue;
      INFO(one.key.path + ": explain it in a comment next to the key in " + kind.files);
      CHECK_FALSE(one.meaning.empty());
    }
  }
}

TEST_CASE("Schemas and document are in step with the readers") {
  for (const ConfigKind& kind : config_kinds()) {
    const std::string schema = key_schema(kind, described_keys(kind));
    CHECK(nlohmann::json::parse(schema).at("additionalProperties") == false);
    in_step(kind.schema, schema);
  }
  const std::string document = "docs/configuration.md";
  in_step(document, filled(read_file(document), document_of_keys()));
}
