// SPDX-License-Identifier: BSD-3-Clause
#include "app/batch/database.h"

#include <sqlite3.h>

#include <cmath>
#include <limits>
#include <stdexcept>

#include "common/core/error.h"

namespace berth {

Statement::Statement(Database& database, const std::string& sql) : database_(database.database_) {
  check(sqlite3_prepare_v2(database_, sql.c_str(), -1, &statement_, nullptr));
}

Statement::~Statement() { sqlite3_finalize(statement_); }

void Statement::check(int code) const {
  if (code == SQLITE_OK) return;
  throw std::runtime_error(std::string("results: ") + sqlite3_errmsg(database_));
}

void Statement::reset() {
  sqlite3_reset(statement_);
  parameter_ = column_ = 0;
}

bool Statement::step() {
  column_ = 0;
  const int code = sqlite3_step(statement_);
  if (code == SQLITE_ROW) return true;
  check(code == SQLITE_DONE ? SQLITE_OK : code);
  return false;
}

void Statement::bind_next(std::int64_t value) {
  check(sqlite3_bind_int64(statement_, ++parameter_, value));
}

void Statement::bind_next(double value) {
  // SQLite makes NULL of NaN itself.
  check(sqlite3_bind_double(statement_, ++parameter_, value));
}

void Statement::bind_next(const std::string& value) {
  check(sqlite3_bind_text(statement_, ++parameter_, value.data(), static_cast<int>(value.size()),
                          SQLITE_TRANSIENT));
}

std::int64_t Statement::integer() { return sqlite3_column_int64(statement_, column_++); }

double Statement::real() {
  const int column = column_++;
  if (sqlite3_column_type(statement_, column) == SQLITE_NULL) {
    return std::numeric_limits<double>::quiet_NaN();
  }
  return sqlite3_column_double(statement_, column);
}

std::string Statement::text() {
  const int column = column_++;
  const auto* bytes = sqlite3_column_text(statement_, column);
  if (bytes == nullptr) return "";
  return {reinterpret_cast<const char*>(bytes),
          static_cast<std::size_t>(sqlite3_column_bytes(statement_, column))};
}

Database::Database(const std::filesystem::path& file) {
  if (sqlite3_open(file.c_str(), &database_) != SQLITE_OK) {
    const std::string reason = sqlite3_errmsg(database_);
    sqlite3_close(database_);
    throw InputError(file.string() + ": cannot be opened as a store of results: " + reason);
  }
  sqlite3_busy_timeout(database_, 10000);
}

Database::~Database() { sqlite3_close(database_); }

void Database::execute(const std::string& sql) {
  char* message = nullptr;
  if (sqlite3_exec(database_, sql.c_str(), nullptr, nullptr, &message) == SQLITE_OK) return;
  const std::string reason = message == nullptr ? "unknown" : message;
  sqlite3_free(message);
  throw std::runtime_error("results: " + reason);
}

std::int64_t Database::last_id() const { return sqlite3_last_insert_rowid(database_); }

Transaction::Transaction(Database& database) : database_(database) {
  database_.execute("BEGIN IMMEDIATE");
}

Transaction::~Transaction() {
  if (!open_) return;
  try {
    database_.execute("ROLLBACK");
  } catch (const std::runtime_error&) {
    // The file is gone or full: there is nothing left to roll back.
  }
}

void Transaction::commit() {
  database_.execute("COMMIT");
  open_ = false;
}

}  // namespace berth
