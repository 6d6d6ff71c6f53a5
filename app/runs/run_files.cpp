// SPDX-License-Identifier: BSD-3-Clause
#include "app/runs/run_files.h"

#include <arpa/inet.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <optional>
#include <vector>

#include "app/runs/choose_setup.h"
#include "app/runs/config_override.h"
#include "app/runs/manifest.h"
#include "common/bus/process_loop.h"
#include "common/core/config.h"
#include "common/core/error.h"
#include "common/core/file.h"
#include "common/core/sha256.h"
#include "common/core/shared_files.h"
#include "common/core/utc.h"
#include "common/core/yaml_text.h"
#include "common/meshes/symmetry.h"
#include "common/targets/target.h"
#include "estimator/model/target_model.h"
#include "evaluation/run/target_surface.h"
#include "procedures/language/procedure.h"

namespace berth {
namespace fs = std::filesystem;
namespace {

/// A directory that did not exist before.
fs::path make_new_directory(const fs::path& parent, const std::string& name) {
  std::error_code error;
  fs::create_directories(parent, error);
  if (error) throw InputError("run directory " + parent.string() + ": " + error.message());
  for (int i = 1; i < 1000; ++i) {
    const fs::path directory = parent / (i == 1 ? name : name + "-" + std::to_string(i));
    if (fs::create_directory(directory, error)) return fs::absolute(directory);
    if (error) throw InputError("run directory " + directory.string() + ": " + error.message());
  }
  throw InputError("run directory " + (parent / name).string() + ": too many of that name");
}

bool port_is_free(int port) {
  const int fd = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  const int on = 1;
  setsockopt(fd, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
  const bool is_free = bind(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
  close(fd);
  return is_free;
}

/// The simulated devices' usual ports may be taken by another run: moves all of them up together.
void choose_free_ports(const fs::path& devices_file) {
  constexpr int first = 15021;
  constexpr int count = 4;
  const auto all_free = [](int base) {
    for (int i = 0; i < count; ++i) {
      if (!port_is_free(base + i)) return false;
    }
    return true;
  };
  int base = first;
  while (!all_free(base)) {
    base += 10;
    if (base > 30000) throw InputError("no free TCP ports for the simulated devices");
  }
  if (base == first) return;
  std::string text = read_file(devices_file);
  for (int i = 0; i < count; ++i) {
    const std::string from = "127.0.0.1:" + std::to_string(first + i);
    const std::string to = "127.0.0.1:" + std::to_string(base + i);
    for (auto at = text.find(from); at != std::string::npos; at = text.find(from, at + to.size())) {
      text.replace(at, from.size(), to);
    }
  }
  write_file(devices_file, text);
}

constexpr char world_key[] = "simulation.yaml:world";

/// The content of run.yaml apart from the parameters.
struct Description {
  std::string host;
  std::string url;
  bool joins = false;
  std::int64_t session = 0;
  std::uint64_t seed = 1;
  std::string layout;
  std::string target;
  double target_length = 0;
  std::string world;
  std::string estimator;
};

/// The target goes with the run and is named from there: it can then be judged anywhere, and the
/// twin's log does not depend on where it was made.
std::string keep_target(const fs::path& directory, const Target& target) {
  return copy_target(target, directory / "target").lexically_relative(directory).generic_string();
}

/// The target's symmetry as a file, without the motions that would move a docking port. A mesh's
/// symmetry is computed once and cached with the estimator's models.
std::string symmetry_of(const Target& target) {
  const fs::path known =
      estimator::default_cache_directory() / (target.hash.substr(0, 32) + ".symmetry-1.yaml");
  SymmetryGroup symmetry;
  try {
    symmetry = read_symmetry(read_file(known), known.string());
  } catch (const InputError&) {  // not there, or not whole
    symmetry = find_symmetry(RayCaster(target.mesh));
    std::error_code ignored;
    fs::create_directories(known.parent_path(), ignored);
    try {
      write_file(known, yaml_of(symmetry));
    } catch (const InputError&) {  // it is found again next time
    }
  }
  for (const DockingPort& port : target.ports) {
    symmetry = symmetry.keeping(port.pose.position, port.pose.rotation * Vector3d::UnitZ());
  }
  return yaml_of(symmetry);
}

RunFiles write(const RunRequest& request, const std::string& stem, const fs::path& config,
               const Description& description) {
  const Target target = load_target(description.target, description.target_length);
  const std::string symmetry = symmetry_of(target);
  const fs::path directory = make_new_directory(request.out, utc_stamp() + "_" + stem);
  copy_writable(config, directory / "config");
  if (!description.joins) {
    auto parameters = request.parameters;
    if (!description.world.empty()) {
      if (!request.world.empty()) parameters.erase(world_key);
      parameters.emplace(world_key, description.world);  // after a --set of the operator's
    }
    override_configuration(directory / "config", parameters);
    put_calibration(directory / "config", description.layout, request.calibration);
  }
  if (description.host == "simulated-cell" && !description.joins) {
    choose_free_ports(directory / "config" / "devices.yaml");
  }
  fs::create_directory(directory / "output");
  if (!request.procedure.empty()) {
    // As it runs: with the procedures that it calls.
    write_file(
        directory / "procedure.yaml",
        procedures::load_procedure(request.procedure, of_procedure(request.parameters)).text);
  }

  write_file(directory / evaluation::symmetry_file, symmetry);

  // The twin's log must not depend on when it was made.
  const std::string name = description.host == "twin"
                               ? stem + "-twin-seed" + std::to_string(description.seed)
                               : directory.filename().string();
  YamlNode run(YamlNode::Kind::map);
  run.put("name", name);
  run.put("host", description.host);
  run.put("lcm_url", description.url);
  run.put("joins", description.joins ? "true" : "false");
  run.put("session", std::to_string(description.session));
  run.put("seed", std::to_string(description.seed));
  run.put("layout", description.layout);
  run.put("target", keep_target(directory, target));
  run.put("target_length", std::to_string(description.target_length) + " m");
  if (!description.estimator.empty()) run.put("estimator", description.estimator);
  YamlNode parameters(YamlNode::Kind::map);
  for (const auto& [key, value] : request.parameters) parameters.put(key, value);
  run.put("parameters", parameters);
  write_file(directory / "run.yaml", written(run));
  RunFiles files = RunFiles::open(directory);
  write_manifest(files, request);
  return files;
}

/// A procedure in a cell that is up: what the cell is cannot be chosen any more.
RunFiles join(const RunRequest& request) {
  const RunFiles cell = RunFiles::open(request.joins);
  for (const auto& [name, value] : request.parameters) {
    if (!names_configuration(name)) continue;
    throw InputError("a cell is up with its configuration: '" + name + "' cannot be set any more");
  }
  procedures::load_procedure(request.procedure, of_procedure(request.parameters));
  if (!request.calibration.empty()) {
    throw InputError("a cell is up with its calibration: it cannot be given another any more");
  }
  if ((!request.layout.empty() && request.layout != cell.setup.layout) ||
      (!request.target.empty() &&
       fs::path(request.target).filename() != fs::path(cell.setup.target).filename()) ||
      request.target_length > 0 || !request.world.empty()) {
    throw InputError("a cell is up with layout '" + cell.setup.layout + "' and target '" +
                     cell.setup.target + "': bring it down first (berth stop) to have another");
  }
  Description description;
  description.host = cell.host;
  description.url = cell.url;
  description.joins = true;
  description.seed = cell.setup.seed;
  description.session = cell.setup.session;
  description.layout = cell.setup.layout;
  description.target = cell.setup.target;
  description.target_length = cell.setup.target_length;
  description.estimator = cell.estimator;
  return write(request, request.procedure.stem().string(), cell.setup.config, description);
}

}  // namespace

RunFiles RunFiles::create(const RunRequest& request) {
  const bool twin = request.host == "twin";
  if (!request.joins.empty()) return join(request);
  std::string stem = "cell";
  std::optional<procedures::Procedure> procedure;
  if (!request.procedure.empty()) {
    procedure = procedures::load_procedure(request.procedure, of_procedure(request.parameters));
    stem = request.procedure.stem().string();
  }
  const SetupChoice choice{request.config, request.layout, request.target, request.target_length,
                           request.world};
  const procedures::Procedure* own = procedure ? &*procedure : nullptr;
  const RunSetup setup = choose_setup(choice, own);

  Description description;
  description.host = request.host;
  description.url = request.url;
  description.seed = request.seed;
  description.session =
      twin ? static_cast<std::int64_t>(request.seed) : clock_offset_now() + getpid();
  description.layout = setup.layout;
  description.target = setup.target;
  description.target_length = setup.target_length;
  description.world = choose_world(choice, setup.config, own);
  description.estimator = request.estimator;
  return write(request, stem, setup.config, description);
}

RunFiles RunFiles::open(const fs::path& directory) {
  RunFiles files;
  files.directory = fs::absolute(directory);
  Config run = Config::load(files.directory / "run.yaml");
  files.name = run.text("name");
  files.host = run.choice("host", {"simulated-cell", "cell", "twin"});
  files.url = run.text("lcm_url");
  files.joins = run.boolean("joins");
  files.setup.session = run.integer("session");
  files.setup.seed = static_cast<std::uint64_t>(run.integer("seed"));
  files.setup.layout = run.text("layout");
  files.setup.target = run.text("target");
  // Runs of before targets had folders name the shipped one.
  const fs::path target = files.directory / files.setup.target;
  if (fs::exists(target)) files.setup.target = target.string();
  files.setup.target_length = run.quantity("target_length", Dimension::length);
  run.optional("estimator", files.estimator);
  Config parameters = run.section("parameters");
  for (const auto& key : parameters.keys()) files.parameters[key] = parameters.text(key);
  run.finish();
  files.setup.config = files.directory / "config";
  files.setup.out = files.directory;
  files.has_procedure = fs::exists(files.procedure());
  std::string salt = files.setup.layout + " " + fs::path(files.setup.target).filename().string() +
                     " " + std::to_string(files.setup.target_length);
  if (fs::is_directory(target)) salt += " " + sha256_of_tree(target, "");
  files.configuration_hash = sha256_of_tree(files.setup.config, salt);
  return files;
}

}  // namespace berth
