// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <concepts>
#include <cstdint>
#include <filesystem>
#include <string>

struct sqlite3;
struct sqlite3_stmt;

namespace berth {

class Database;

/// A row cursor over one SQL statement. Parameters and columns are taken in their order.
///
///     Statement runs = database.prepare("SELECT seed, outcome FROM run WHERE night = ?");
///     runs.bind(night);
///     while (runs.step()) runs.read(seed, outcome);
///
/// All functions throw std::runtime_error with SQLite's message.
class Statement {
 public:
  Statement(Database& database, const std::string& sql);
  ~Statement();
  Statement(const Statement&) = delete;
  Statement& operator=(const Statement&) = delete;

  template <class... Values>
  Statement& bind(const Values&... values) {
    reset();
    (bind_next(values), ...);
    return *this;
  }
  /// Whether there is a row.
  bool step();
  /// bind and step of a statement that gives no rows.
  template <class... Values>
  void run(const Values&... values) {
    bind(values...).step();
    reset();
  }

  /// The next columns of the row.
  template <class... Values>
  void read(Values&... values) {
    (take(values), ...);
  }
  /// The next one.
  std::int64_t integer();
  double real();  ///< NaN of NULL
  std::string text();

 private:
  void reset();
  void take(std::string& value) { value = text(); }
  void take(double& value) { value = real(); }
  template <std::integral Integer>
  void take(Integer& value) {
    value = static_cast<Integer>(integer());
  }
  void bind_next(std::int64_t value);
  void bind_next(int value) { bind_next(std::int64_t{value}); }
  void bind_next(double value);  // NaN becomes NULL
  void bind_next(const std::string& value);
  void check(int code) const;

  sqlite3* database_;
  sqlite3_stmt* statement_ = nullptr;
  int parameter_ = 0;
  int column_ = 0;
};

/// An SQLite file. Not for several threads.
class Database {
 public:
  /// Opens or makes it. @throws InputError when it cannot be opened.
  explicit Database(const std::filesystem::path& file);
  ~Database();
  Database(const Database&) = delete;
  Database& operator=(const Database&) = delete;

  Statement prepare(const std::string& sql) { return {*this, sql}; }
  /// Statements without parameters and rows.
  void execute(const std::string& sql);
  std::int64_t last_id() const;

 private:
  friend class Statement;
  sqlite3* database_ = nullptr;
};

/// All or nothing: rolled back unless committed.
class Transaction {
 public:
  explicit Transaction(Database& database);
  ~Transaction();
  Transaction(const Transaction&) = delete;
  Transaction& operator=(const Transaction&) = delete;
  void commit();

 private:
  Database& database_;
  bool open_ = true;
};

}  // namespace berth
