// SPDX-License-Identifier: BSD-3-Clause
#include "app/batch/nights/history.h"

#include <map>

#include "common/core/error.h"

namespace berth::nights {
namespace {

constexpr std::int64_t schema_version = 1;

/// Times are UTC in ISO 8601. The view `result` is for people with sqlite3.
constexpr char schema[] = R"(
CREATE TABLE night (
  id INTEGER PRIMARY KEY, number INTEGER NOT NULL, name TEXT NOT NULL UNIQUE,
  begun TEXT NOT NULL, ended TEXT NOT NULL DEFAULT '',
  plan_hash TEXT NOT NULL, build TEXT NOT NULL, baseline TEXT NOT NULL, version TEXT NOT NULL,
  configuration_hash TEXT NOT NULL DEFAULT '', verdict TEXT NOT NULL DEFAULT '',
  accepted INTEGER NOT NULL DEFAULT 0, wall_s REAL NOT NULL DEFAULT 0);
CREATE TABLE run (
  id INTEGER PRIMARY KEY, night INTEGER NOT NULL REFERENCES night(id),
  "case" TEXT NOT NULL, build TEXT NOT NULL, seed INTEGER NOT NULL, fresh INTEGER NOT NULL,
  procedure TEXT NOT NULL, procedure_hash TEXT NOT NULL, target TEXT NOT NULL, host TEXT NOT NULL,
  version TEXT NOT NULL, configuration_hash TEXT NOT NULL,
  outcome TEXT NOT NULL, reason TEXT NOT NULL, directory TEXT NOT NULL,
  simulated_s REAL, wall_s REAL, cpu_s REAL,
  UNIQUE (night, "case", build, seed));
CREATE TABLE quantity (
  id INTEGER PRIMARY KEY, phase TEXT NOT NULL, measurement TEXT NOT NULL, statistic TEXT NOT NULL,
  unit TEXT NOT NULL, UNIQUE (phase, measurement, statistic, unit));
CREATE TABLE value (
  run INTEGER NOT NULL REFERENCES run(id), quantity INTEGER NOT NULL REFERENCES quantity(id),
  value REAL, samples INTEGER NOT NULL, PRIMARY KEY (run, quantity)) WITHOUT ROWID;
CREATE TABLE change (
  night INTEGER NOT NULL REFERENCES night(id), against TEXT NOT NULL, "case" TEXT NOT NULL,
  phase TEXT NOT NULL, measurement TEXT NOT NULL, statistic TEXT NOT NULL, unit TEXT NOT NULL,
  before REAL, after REAL, low REAL, high REAL, p REAL, kind TEXT NOT NULL, runs INTEGER NOT NULL);
CREATE INDEX change_of_night ON change (night);
CREATE VIEW result AS
  SELECT night.name AS night, run."case", run.build, run.version, run.configuration_hash, run.seed,
         run.fresh, run.outcome, quantity.phase, quantity.measurement, quantity.statistic,
         value.value, quantity.unit, value.samples
  FROM value JOIN quantity ON quantity.id = value.quantity JOIN run ON run.id = value.run
       JOIN night ON night.id = run.night;
)";

constexpr char night_columns[] =
    "SELECT id, number, name, begun, ended, plan_hash, build, baseline, version, "
    "configuration_hash, verdict, accepted, wall_s FROM night ";

Build build_named(const std::string& name) {
  return name == name_of(Build::tonight) ? Build::tonight : Build::baseline;
}

Night night_of(Statement& row) {
  Night night;
  row.read(night.id, night.number, night.name, night.begun, night.ended, night.plan_hash,
           night.build, night.baseline, night.version, night.configuration_hash, night.verdict,
           night.accepted, night.wall_s);
  return night;
}

}  // namespace

History::History(const std::filesystem::path& file) : database_(file) {
  try {
    // A reader does not delay the night, and a power cut loses nothing that was reported as done.
    database_.execute("PRAGMA journal_mode = WAL; PRAGMA foreign_keys = ON;");
    Transaction transaction(database_);
    Statement version = database_.prepare("PRAGMA user_version");
    version.step();
    const std::int64_t found = version.integer();
    if (found > schema_version) {
      throw InputError(file.string() + ": written by a newer Berth (schema " +
                       std::to_string(found) + ", known here: " + std::to_string(schema_version) +
                       ")");
    }
    if (found == 0) {
      database_.execute(schema);
      database_.execute("PRAGMA user_version = " + std::to_string(schema_version));
    }
    version.step();
    transaction.commit();
  } catch (const std::runtime_error& e) {
    if (dynamic_cast<const InputError*>(&e) != nullptr) throw;
    throw InputError(file.string() + ": not a history of nights: " + e.what());
  }
}

std::vector<Night> History::nights() {
  std::vector<Night> nights;
  Statement rows = database_.prepare(std::string(night_columns) + "ORDER BY number");
  while (rows.step()) nights.push_back(night_of(rows));
  return nights;
}

std::optional<Night> History::night_named(const std::string& name) {
  Statement row = database_.prepare(std::string(night_columns) + "WHERE name = ?");
  if (!row.bind(name).step()) return std::nullopt;
  return night_of(row);
}

void History::begin(Night& night) {
  Transaction transaction(database_);
  Statement last = database_.prepare("SELECT coalesce(max(number), 0) FROM night");
  last.step();
  night.number = last.integer() + 1;
  database_
      .prepare(
          "INSERT INTO night (number, name, begun, plan_hash, build, baseline, version) "
          "VALUES (?, ?, ?, ?, ?, ?, ?)")
      .run(night.number, night.name, night.begun, night.plan_hash, night.build, night.baseline,
           night.version);
  night.id = database_.last_id();
  transaction.commit();
}

void History::finish(const Night& night, const std::vector<FlaggedChange>& changes) {
  Transaction transaction(database_);
  database_.prepare("DELETE FROM change WHERE night = ?").run(night.id);
  Statement insert =
      database_.prepare("INSERT INTO change VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)");
  for (const FlaggedChange& c : changes) {
    insert.run(night.id, c.against, c.case_name, c.phase, c.measurement, c.statistic, c.unit,
               c.before, c.after, c.low, c.high, c.p, c.kind, static_cast<std::int64_t>(c.runs));
  }
  database_
      .prepare(
          "UPDATE night SET ended = ?, configuration_hash = ?, verdict = ?, wall_s = ? "
          "WHERE id = ?")
      .run(night.ended, night.configuration_hash, night.verdict, night.wall_s, night.id);
  transaction.commit();
}

void History::accept(const std::string& night) {
  const auto found = night_named(night);
  if (!found || found->ended.empty()) {
    throw InputError("--accept " + night + ": there is no finished night of that name");
  }
  database_.prepare("UPDATE night SET accepted = 1 WHERE name = ?").run(night);
}

std::int64_t History::quantity(const RunValue& v) {
  Statement find = database_.prepare(
      "SELECT id FROM quantity WHERE phase = ? AND measurement = ? AND statistic = ? AND unit = ?");
  if (find.bind(v.phase, v.measurement, v.statistic, v.unit).step()) return find.integer();
  database_
      .prepare("INSERT INTO quantity (phase, measurement, statistic, unit) VALUES (?, ?, ?, ?)")
      .run(v.phase, v.measurement, v.statistic, v.unit);
  return database_.last_id();
}

void History::record(const Night& night, const FinishedRun& run) {
  Transaction transaction(database_);
  database_
      .prepare(
          "INSERT INTO run (night, \"case\", build, seed, fresh, procedure, procedure_hash, "
          "target, host, version, configuration_hash, outcome, reason, directory, simulated_s, "
          "wall_s, cpu_s) VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)")
      .run(night.id, run.case_name, std::string(name_of(run.build)),
           static_cast<std::int64_t>(run.seed), run.fresh ? 1 : 0, run.procedure,
           run.procedure_hash, run.target, run.host, run.version, run.configuration_hash,
           std::string(name_of(run.outcome)), run.error, run.directory, run.simulated_s, run.wall_s,
           run.cpu_s);
  const std::int64_t id = database_.last_id();
  Statement insert = database_.prepare("INSERT OR REPLACE INTO value VALUES (?, ?, ?, ?)");
  for (const RunValue& value : run.values) {
    insert.run(id, quantity(value), value.value, value.samples);
  }
  database_.prepare("UPDATE night SET wall_s = ? WHERE id = ?").run(night.wall_s, night.id);
  transaction.commit();
}

void History::forget_directory(const Night& night, const std::string& directory) {
  database_.prepare("UPDATE run SET directory = '' WHERE night = ? AND directory = ?")
      .run(night.id, directory);
}

std::vector<FinishedRun> History::runs(const Night& night, Which which) {
  const std::string condition = which == Which::fixed   ? " AND NOT run.fresh "
                                : which == Which::fresh ? " AND run.fresh "
                                                        : " ";
  std::vector<FinishedRun> runs;
  std::map<std::int64_t, std::size_t> place;
  Statement rows = database_.prepare(
      "SELECT id, \"case\", build, seed, fresh, procedure, procedure_hash, target, host, version, "
      "configuration_hash, outcome, reason, directory, simulated_s, wall_s, cpu_s FROM run "
      "WHERE night = ?" +
      condition + "ORDER BY id");
  rows.bind(night.id);
  while (rows.step()) {
    place[rows.integer()] = runs.size();
    FinishedRun& run = runs.emplace_back();
    std::string build;
    std::string outcome;
    rows.read(run.case_name, build, run.seed, run.fresh, run.procedure, run.procedure_hash,
              run.target, run.host, run.version, run.configuration_hash, outcome, run.error,
              run.directory, run.simulated_s, run.wall_s, run.cpu_s);
    run.build = build_named(build);
    run.outcome = outcome_named(outcome).value_or(Outcome::error);
  }
  if (which == Which::all_without_values) return runs;
  Statement values = database_.prepare(
      "SELECT run.id, phase, measurement, statistic, unit, value, samples FROM run "
      "JOIN value ON value.run = run.id JOIN quantity ON quantity.id = value.quantity "
      "WHERE run.night = ?" +
      condition + "ORDER BY run.id, quantity.id");
  values.bind(night.id);
  while (values.step()) {
    auto& list = runs[place.at(values.integer())].values;
    RunValue& value = list.emplace_back();
    values.read(value.phase, value.measurement, value.statistic, value.unit, value.value,
                value.samples);
  }
  return runs;
}

std::vector<TrendValue> History::trend(std::int64_t first_night, const std::string& case_name,
                                       const std::string& phase, const std::string& measurement,
                                       const std::string& statistic) {
  std::vector<TrendValue> values;
  Statement rows = database_.prepare(
      "SELECT night.number, run.build, value.value FROM night "
      "JOIN run ON run.night = night.id AND run.\"case\" = ? "
      "CROSS JOIN quantity ON quantity.phase = ? AND quantity.measurement = ? "
      "AND quantity.statistic = ? "
      "JOIN value ON value.run = run.id AND value.quantity = quantity.id "
      "WHERE night.number >= ? AND night.ended <> '' ORDER BY night.number");
  rows.bind(case_name, phase, measurement, statistic, first_night);
  while (rows.step()) {
    TrendValue& value = values.emplace_back();
    std::string build;
    rows.read(value.night, build, value.value);
    value.build = build_named(build);
  }
  return values;
}

std::vector<FlaggedChange> History::changes(const Night& night) {
  std::vector<FlaggedChange> changes;
  Statement rows = database_.prepare(
      "SELECT against, \"case\", phase, measurement, statistic, unit, before, after, low, high, p, "
      "kind, runs FROM change WHERE night = ?");
  rows.bind(night.id);
  while (rows.step()) {
    FlaggedChange& c = changes.emplace_back();
    rows.read(c.against, c.case_name, c.phase, c.measurement, c.statistic, c.unit, c.before,
              c.after, c.low, c.high, c.p, c.kind, c.runs);
  }
  return changes;
}

}  // namespace berth::nights
