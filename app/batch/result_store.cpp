// SPDX-License-Identifier: BSD-3-Clause
#include "app/batch/result_store.h"

#include <algorithm>
#include <tuple>

#include "common/core/error.h"

namespace berth {
namespace {

constexpr std::int64_t schema_version = 1;

/// Times are UTC in ISO 8601. The view `result` is for people with sqlite3. As released with the
/// nights: what others need stands in a table of its own.
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

constexpr char detail_schema[] =
    "CREATE TABLE IF NOT EXISTS detail (run INTEGER NOT NULL REFERENCES run(id), "
    "name TEXT NOT NULL, value TEXT NOT NULL, PRIMARY KEY (run, name)) WITHOUT ROWID";

constexpr char batch_columns[] =
    "SELECT id, number, name, begun, ended, plan_hash, build, baseline, version, "
    "configuration_hash, verdict, accepted, wall_s FROM night ";

Build build_named(const std::string& name) {
  return name == name_of(Build::tonight) ? Build::tonight : Build::baseline;
}

BatchRecord batch_of(Statement& row) {
  BatchRecord batch;
  row.read(batch.id, batch.number, batch.name, batch.begun, batch.ended, batch.plan_hash,
           batch.build, batch.baseline, batch.version, batch.configuration_hash, batch.verdict,
           batch.accepted, batch.wall_s);
  return batch;
}

std::int64_t quantity_of(Database& database, const RunValue& v) {
  Statement find = database.prepare(
      "SELECT id FROM quantity WHERE phase = ? AND measurement = ? AND statistic = ? AND unit = ?");
  if (find.bind(v.phase, v.measurement, v.statistic, v.unit).step()) return find.integer();
  database.prepare("INSERT INTO quantity (phase, measurement, statistic, unit) VALUES (?, ?, ?, ?)")
      .run(v.phase, v.measurement, v.statistic, v.unit);
  return database.last_id();
}

}  // namespace

const char* name_of(Build build) { return build == Build::tonight ? "tonight" : "baseline"; }

ResultStore::ResultStore(const std::filesystem::path& file) : database_(file) {
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
    throw InputError(file.string() + ": not a store of results: " + e.what());
  }
}

std::vector<BatchRecord> ResultStore::batches() {
  std::vector<BatchRecord> batches;
  Statement rows = database_.prepare(std::string(batch_columns) + "ORDER BY number");
  while (rows.step()) batches.push_back(batch_of(rows));
  return batches;
}

std::optional<BatchRecord> ResultStore::batch_named(const std::string& name) {
  Statement row = database_.prepare(std::string(batch_columns) + "WHERE name = ?");
  if (!row.bind(name).step()) return std::nullopt;
  return batch_of(row);
}

std::string ResultStore::free_name(const std::string& name) {
  std::string free = name;
  for (int i = 2; batch_named(free); ++i) free = name + "-" + std::to_string(i);
  return free;
}

void ResultStore::begin(BatchRecord& batch) {
  Transaction transaction(database_);
  Statement last = database_.prepare("SELECT coalesce(max(number), 0) FROM night");
  last.step();
  batch.number = last.integer() + 1;
  database_
      .prepare(
          "INSERT INTO night (number, name, begun, plan_hash, build, baseline, version) "
          "VALUES (?, ?, ?, ?, ?, ?, ?)")
      .run(batch.number, batch.name, batch.begun, batch.plan_hash, batch.build, batch.baseline,
           batch.version);
  batch.id = database_.last_id();
  transaction.commit();
}

void ResultStore::finish(const BatchRecord& batch, const std::vector<FlaggedChange>& changes) {
  Transaction transaction(database_);
  database_.prepare("DELETE FROM change WHERE night = ?").run(batch.id);
  Statement insert =
      database_.prepare("INSERT INTO change VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)");
  for (const FlaggedChange& c : changes) {
    insert.run(batch.id, c.against, c.case_name, c.phase, c.measurement, c.statistic, c.unit,
               c.before, c.after, c.low, c.high, c.p, c.kind, static_cast<std::int64_t>(c.runs));
  }
  database_
      .prepare(
          "UPDATE night SET ended = ?, configuration_hash = ?, verdict = ?, wall_s = ? "
          "WHERE id = ?")
      .run(batch.ended, batch.configuration_hash, batch.verdict, batch.wall_s, batch.id);
  transaction.commit();
}

void ResultStore::accept(const std::string& batch) {
  const auto found = batch_named(batch);
  if (!found || found->ended.empty()) {
    throw InputError("--accept " + batch + ": there is no finished night of that name");
  }
  database_.prepare("UPDATE night SET accepted = 1 WHERE name = ?").run(batch);
}

void ResultStore::record(const BatchRecord& batch, const std::vector<FinishedRun>& runs) {
  Transaction transaction(database_);
  const bool details = std::any_of(runs.begin(), runs.end(),
                                   [](const FinishedRun& run) { return !run.details.empty(); });
  if (details) database_.execute(detail_schema);
  std::map<std::tuple<std::string, std::string, std::string, std::string>, std::int64_t> known;
  const auto quantity = [&](const RunValue& v) {
    std::int64_t& id = known[{v.phase, v.measurement, v.statistic, v.unit}];
    if (id == 0) id = quantity_of(database_, v);
    return id;
  };
  Statement insert_run = database_.prepare(
      "INSERT INTO run (night, \"case\", build, seed, fresh, procedure, procedure_hash, target, "
      "host, version, configuration_hash, outcome, reason, directory, simulated_s, wall_s, cpu_s) "
      "VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)");
  Statement insert_value = database_.prepare("INSERT OR REPLACE INTO value VALUES (?, ?, ?, ?)");
  std::optional<Statement> insert_detail;
  if (details) insert_detail.emplace(database_, "INSERT INTO detail VALUES (?, ?, ?)");
  for (const FinishedRun& run : runs) {
    insert_run.run(batch.id, run.case_name, std::string(name_of(run.build)),
                   static_cast<std::int64_t>(run.seed), run.fresh ? 1 : 0, run.procedure,
                   run.procedure_hash, run.target, run.host, run.version, run.configuration_hash,
                   std::string(name_of(run.outcome)), run.error, run.directory, run.simulated_s,
                   run.wall_s, run.cpu_s);
    const std::int64_t id = database_.last_id();
    for (const RunValue& value : run.values) {
      insert_value.run(id, quantity(value), value.value, value.samples);
    }
    for (const auto& [name, value] : run.details) insert_detail->run(id, name, value);
  }
  database_.prepare("UPDATE night SET wall_s = ? WHERE id = ?").run(batch.wall_s, batch.id);
  transaction.commit();
}

void ResultStore::forget_directory(const BatchRecord& batch, const std::string& directory) {
  database_.prepare("UPDATE run SET directory = '' WHERE night = ? AND directory = ?")
      .run(batch.id, directory);
}

void ResultStore::for_each_run(const BatchRecord& batch, Which which,
                               const std::function<void(FinishedRun)>& each) {
  const std::string condition = which == Which::fixed   ? " AND NOT fresh "
                                : which == Which::fresh ? " AND fresh "
                                                        : " ";
  Statement rows = database_.prepare(
      "SELECT id, \"case\", build, seed, fresh, procedure, procedure_hash, target, host, version, "
      "configuration_hash, outcome, reason, directory, simulated_s, wall_s, cpu_s FROM run "
      "WHERE night = ?" +
      condition + "ORDER BY id");
  Statement values = database_.prepare(
      "SELECT phase, measurement, statistic, unit, value, samples FROM value "
      "JOIN quantity ON quantity.id = value.quantity WHERE run = ? ORDER BY quantity.id");
  std::optional<Statement> details;
  if (database_.prepare("SELECT 1 FROM sqlite_master WHERE name = 'detail'").step()) {
    details.emplace(database_, "SELECT name, value FROM detail WHERE run = ?");
  }
  rows.bind(batch.id);
  while (rows.step()) {
    FinishedRun run;
    const std::int64_t id = rows.integer();
    std::string build;
    std::string outcome;
    rows.read(run.case_name, build, run.seed, run.fresh, run.procedure, run.procedure_hash,
              run.target, run.host, run.version, run.configuration_hash, outcome, run.error,
              run.directory, run.simulated_s, run.wall_s, run.cpu_s);
    run.build = build_named(build);
    run.outcome = outcome_named(outcome).value_or(Outcome::error);
    if (which != Which::all_without_values) {
      values.bind(id);
      while (values.step()) {
        RunValue& value = run.values.emplace_back();
        values.read(value.phase, value.measurement, value.statistic, value.unit, value.value,
                    value.samples);
      }
      if (details) details->bind(id);
      while (details && details->step()) {
        const std::string name = details->text();
        run.details[name] = details->text();
      }
    }
    each(std::move(run));
  }
}

std::vector<FinishedRun> ResultStore::runs(const BatchRecord& batch, Which which) {
  std::vector<FinishedRun> runs;
  for_each_run(batch, which, [&](FinishedRun run) { runs.push_back(std::move(run)); });
  return runs;
}

std::vector<TrendValue> ResultStore::trend(std::int64_t first_batch, const std::string& case_name,
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
  rows.bind(case_name, phase, measurement, statistic, first_batch);
  while (rows.step()) {
    TrendValue& value = values.emplace_back();
    std::string build;
    rows.read(value.batch, build, value.value);
    value.build = build_named(build);
  }
  return values;
}

std::vector<FlaggedChange> ResultStore::changes(const BatchRecord& batch) {
  std::vector<FlaggedChange> changes;
  Statement rows = database_.prepare(
      "SELECT against, \"case\", phase, measurement, statistic, unit, before, after, low, high, p, "
      "kind, runs FROM change WHERE night = ?");
  rows.bind(batch.id);
  while (rows.step()) {
    FlaggedChange& c = changes.emplace_back();
    rows.read(c.against, c.case_name, c.phase, c.measurement, c.statistic, c.unit, c.before,
              c.after, c.low, c.high, c.p, c.kind, c.runs);
  }
  return changes;
}

}  // namespace berth
