// SPDX-License-Identifier: BSD-3-Clause
#include <cstdlib>
#include <set>

#include "app/batch/campaigns/campaign.h"
#include "app/batch/campaigns/results.h"
#include "app/batch/campaigns/trial_store.h"
#include "common/core/error.h"
#include "common/targets/target.h"
#include "test/catch.h"
#include "test/common/core/temporary_directory.h"

using namespace berth;
using namespace berth::campaigns;
using Catch::Matchers::Contains;

namespace {

const std::string acquisition = R"(name: few
experiment: acquisition
seed: 3
trials: 5
grid:
  returns: [50, 100, 200]
  range_noise: [5 mm, 10 mm]
draw:
  attitude: any attitude
  right: {uniform: [-100 mm, 100 mm]}
  down: {normal: [0 mm, 20 mm]}
  angle_noise: {log_uniform: [0.1 mrad, 1 mrad]}
  plate: {choice: [0, 1]}
set:
  range: 5.5 m
measurements: [position_error, attitude_error]
)";

Manifest parsed(const std::string& text) { return parse_manifest(text, "campaigns/few.yaml"); }

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const auto at = text.find(from);
  REQUIRE(at != std::string::npos);
  return text.replace(at, from.size(), to);
}

std::string error_of(const std::string& from, const std::string& to) {
  try {
    parsed(replaced(acquisition, from, to));
  } catch (const InputError& e) {
    return e.what();
  }
  return "none";
}

double number_in(const Trial& trial, const std::string& name) {
  for (const auto& [known, text] : trial.parameters) {
    if (known == name) return quantity_of(text).value().value;
  }
  FAIL("no parameter " << name);
  return 0;
}

}  // namespace

TEST_CASE("the points of a campaign are all combinations of its grid, the last one fastest") {
  const Manifest manifest = parsed(acquisition);
  CHECK(manifest.points() == 6);
  CHECK(manifest.total() == 30);
  CHECK(manifest.place_of(1) == std::vector<std::size_t>{0, 1});
  CHECK(manifest.place_of(4) == std::vector<std::size_t>{2, 0});
  const Trial trial = trial_of(manifest, 4 + 6 * 3);
  CHECK(trial.point == 4);
  CHECK(trial.parameters[0] == std::make_pair(std::string("returns"), std::string("200")));
  CHECK(trial.parameters[1] == std::make_pair(std::string("range_noise"), std::string("5 mm")));
  CHECK(trial.fixed[0].second == "5.5 m");
}

TEST_CASE("a trial is a function of seed and index, not of how many there are") {
  const Manifest manifest = parsed(acquisition);
  const Manifest more = parsed(replaced(acquisition, "trials: 5", "trials: 5000"));
  const Manifest other = parsed(replaced(acquisition, "seed: 3", "seed: 4"));
  std::set<std::uint64_t> seeds;
  for (std::int64_t i = 0; i < manifest.total(); ++i) {
    const Trial trial = trial_of(manifest, i);
    CHECK(trial.seed == trial_of(more, i).seed);
    CHECK(trial.parameters == trial_of(more, i).parameters);
    CHECK(trial.seed != trial_of(other, i).seed);
    CHECK(trial.seed < std::uint64_t{1} << 53);
    seeds.insert(trial.seed);
  }
  CHECK(std::ssize(seeds) == manifest.total());
}

TEST_CASE("what is drawn is drawn from where the manifest says") {
  const Manifest manifest = parsed(replaced(acquisition, "trials: 5", "trials: 1000"));
  double right = 0;
  double below = 0;  // the geometric middle of the log-uniform
  double square = 0;
  double plates = 0;
  Vector3d axis = Vector3d::Zero();
  double trace = 0;
  constexpr int n = 6000;
  for (int i = 0; i < n; ++i) {
    const Trial trial = trial_of(manifest, i);
    const double r = number_in(trial, "right");
    REQUIRE(std::abs(r) <= 100);
    right += r / n;
    square += std::pow(number_in(trial, "down"), 2) / n;
    const double noise = number_in(trial, "angle_noise");
    REQUIRE((noise >= 0.1 && noise <= 1));
    below += (noise < std::sqrt(0.1) ? 1.0 : 0.0) / n;
    plates += number_in(trial, "plate") / n;
    REQUIRE(trial.attitude.has_value());
    axis += *trial.attitude * Vector3d::UnitZ() / n;
    trace += trial.attitude->toRotationMatrix().trace() / n;
  }
  // Five sigma of a mean of 6,000.
  CHECK(std::abs(right) < 5 * 57.7 / std::sqrt(n));
  CHECK(std::abs(std::sqrt(square) - 20) < 5 * 20 / std::sqrt(2.0 * n));
  CHECK(std::abs(below - 0.5) < 5 * 0.5 / std::sqrt(n));
  CHECK(std::abs(plates - 0.5) < 5 * 0.5 / std::sqrt(n));
  CHECK(axis.norm() < 5 / std::sqrt(n));
  CHECK(std::abs(trace) < 5 / std::sqrt(n));  // uniform over SO(3): mean 0, variance 1
}

TEST_CASE("an attitude in a list becomes the pendant's angles, and is reported") {
  const Manifest manifest = parsed(replaced(acquisition, "any attitude", "[any attitude]"));
  const Trial trial = trial_of(manifest, 0);
  const std::string text = trial.parameters[2].second;
  CHECK(text.front() == '[');
  CHECK(std::count(text.begin(), text.end(), ',') == 2);
}

TEST_CASE("an error in a manifest names file, line and key") {
  CHECK(error_of("seed: 3", "sead: 3") ==
        "campaigns/few.yaml:3: key 'sead': is not known here; did you mean 'seed'?");
  CHECK_THAT(
      error_of("trials: 5", "trials: 0"),
      Contains("campaigns/few.yaml:4: key 'trials': found '0', expected a whole number from 1 "
               "to 1000000000"));
  CHECK_THAT(error_of("returns: [50, 100, 200]", "returns: 50"),
             Contains(":6: key 'grid.returns': expected a list"));
  CHECK_THAT(error_of("returns: [50", "returns: [fifty"), Contains(":6: key 'grid.returns': "));
  CHECK_THAT(error_of("range_noise: [5 mm", "range_noise: [5 deg"),
             Contains(":7: key 'grid.range_noise'"));
  CHECK_THAT(error_of("range_noise:", "rnage_noise:"),
             Contains(":7: key 'grid.rnage_noise': no parameter of an acquisition"));
  CHECK_THAT(error_of("{uniform: [-100 mm, 100 mm]}", "{uniform: [-100 mm, 100 m]}"),
             Contains(":10: key 'draw.right': uniform: found [-100 mm, 100 m]"));
  CHECK_THAT(error_of("{uniform: [-100 mm, 100 mm]}", "{unifrom: [-100 mm, 100 mm]}"),
             Contains("found 'unifrom', expected a distribution"));
  CHECK_THAT(error_of("{log_uniform: [0.1 mrad", "{log_uniform: [0 mrad"), Contains("above zero"));
  CHECK_THAT(error_of("  attitude: any attitude\n", ""), Contains("'attitude' is missing"));
  CHECK_THAT(error_of("  range: 5.5 m", "  range_noise: 5 mm"), Contains("appears twice"));
  CHECK_THAT(error_of("  range: 5.5 m", "  right: {uniform: [0, 1]}"), Contains("key 'set.right'"));
  CHECK_THAT(error_of("[position_error", "[positon_error"),
             Contains(":16: key 'measurements': 'positon_error': no measurement"));
  CHECK_THAT(error_of("experiment: acquisition", "experiment: aquisition"),
             Contains(":2: key 'experiment'"));
  CHECK_THAT(error_of("experiment: acquisition", "procedure: nowhere.yaml"),
             Contains(":2: key 'procedure': found 'nowhere.yaml'"));
  CHECK_THAT(error_of("  range: 5.5 m", "  estimator.yaml:acquisition.beems: 5"),
             Contains("no key 'beems'"));
  CHECK_THAT(error_of("  range: 5.5 m", "  twin.yaml:compute_delay.testbed: 5 ms"),
             Contains("no other file"));
}

TEST_CASE("a procedure's campaign checks parameters, phases and keys of the configuration") {
  const auto with = [](const std::string& more, const std::string& measurements) {
    return parse_manifest("procedure: procedures/approach.yaml\ntrials: 2\n" + more +
                              "measurements: [" + measurements + "]\n",
                          "few.yaml");
  };
  const Manifest manifest =
      with("grid:\n  lidars/ilris_3d.yaml:rate: [1000 Hz, 2 kHz]\n  speed: [10 mm/s]\n",
           "p95 position_error in hold, time_to_acquire");
  CHECK(manifest.measurements[0].statistic == evaluation::Statistic::p95);
  CHECK(manifest.measurements[0].phase == "hold");
  CHECK(manifest.measurements[1].unit == "s");
  const auto what = [&](const std::string& more, const std::string& measurements) {
    try {
      with(more, measurements);
    } catch (const InputError& e) {
      return std::string(e.what());
    }
    return std::string("none");
  };
  CHECK_THAT(what("grid:\n  sped: [10 mm/s]\n", "duration"),
             Contains("few.yaml:4: key 'grid.sped'"));
  CHECK_THAT(what("grid:\n  speed: [10 mm]\n", "duration"),
             Contains("few.yaml:4: key 'grid.speed'"));
  CHECK_THAT(what("grid:\n  lidars/none.yaml:rate: [1 Hz]\n", "duration"), Contains("no file"));
  CHECK_THAT(what("grid:\n  lidars/ilris_3d.yaml:rate: [1 m]\n", "duration"), Contains("1 m"));
  CHECK_THAT(what("", "rms duration"), Contains("no statistic"));
  CHECK_THAT(what("", "position_error in orbit"), Contains("found phase 'orbit'"));
}

TEST_CASE("several targets are an axis of the grid, each with its length") {
  const TemporaryDirectory directory;
  save_ply(make_box({1, 1, 2}), directory / "crate.ply");
  unsetenv("BERTH_NO_SUCH_FOLDER");
  const std::string text =
      replaced(acquisition, "seed: 3\n",
               "seed: 3\ntargets:\n"
               "  - {target: radarsat2, length: 3 m}\n"
               "  - {target: crate.ply, length: 1.5 m}\n"
               "  - {target: \"${BERTH_NO_SUCH_FOLDER}/mir.ply\", length: 2 m}\n");
  const Manifest manifest = parse_manifest(text, (directory / "few.yaml").string());
  CHECK(manifest.points() == 2 * 3 * 2);
  CHECK_THAT(manifest.notes.at(0), Contains("mir.ply is left out"));
  const CampaignTarget first = manifest.target_of(trial_of(manifest, 0).parameters);
  CHECK(first.place == "radarsat2");
  CHECK(first.length == 3);
  const CampaignTarget last = manifest.target_of(trial_of(manifest, 11).parameters);
  CHECK(last.name == "crate");
  CHECK(last.place == (directory / "crate.ply").string());
  CHECK(last.length == 1.5);

  // A campaign's directory has them all, whatever becomes of their files and of the environment.
  const Campaign campaign = Campaign::create(manifest, directory / "campaign", 0);
  std::filesystem::remove(directory / "crate.ply");
  setenv("BERTH_NO_SUCH_FOLDER", directory.path().c_str(), 1);
  const Manifest kept = Campaign::open(directory / "campaign").manifest();
  unsetenv("BERTH_NO_SUCH_FOLDER");
  CHECK(kept.points() == manifest.points());
  const CampaignTarget copy = kept.target_of(trial_of(kept, 11).parameters);
  CHECK(copy.length == 1.5);
  CHECK(load_target(copy.place, copy.length).length == Approx(1.5));

  const auto what = [&](const std::string& from, const std::string& to) {
    try {
      parse_manifest(replaced(text, from, to), (directory / "few.yaml").string());
    } catch (const InputError& e) {
      return std::string(e.what());
    }
    return std::string("none");
  };
  CHECK_THAT(what("crate.ply", "none.ply"), Contains("few.yaml:6: ") && Contains("none.ply"));
  CHECK_THAT(what("seed: 3", "target: radarsat2"), Contains("'targets'"));
}

TEST_CASE("a result is one line, and the line is the result") {
  TrialResult result = result_for(trial_of(parsed(acquisition), 11));
  result.outcome = Outcome::fail;
  result.failure = "silently wrong";
  result.measurements = {{"position_error", 1.0 / 3}};
  result.error = "a \"quoted\"\nline";
  const std::string line = line_of(result);
  CHECK(line.find('\n') == std::string::npos);
  const TrialResult again = result_of_line(line, "here:1");
  CHECK(line_of(again) == line);
  CHECK(again.parameters == result.parameters);
  CHECK(again.measurement("position_error") == 1.0 / 3);
  CHECK(std::isnan(again.measurement("attitude_error")));
  CHECK(again.attitude->coeffs() == result.attitude->coeffs());
  CHECK_THROWS_WITH(result_of_line("{}", "here:7"), Contains("here:7"));

  // The store gives the same back.
  const TemporaryDirectory directory;
  const Manifest manifest = parsed(acquisition);
  TrialWriter writer(manifest, directory / "results.sqlite", {});
  writer.add({result});
  writer.finish();
  std::vector<std::string> stored;
  for_each_trial(manifest, directory / "results.sqlite",
                 [&](const TrialResult& trial) { stored.push_back(line_of(trial)); });
  CHECK(stored == std::vector<std::string>{line});
}
