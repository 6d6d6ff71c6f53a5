// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace CLI {
class App;
}

/// One function per subcommand of berth: adds its options, and a callback that sets exit_code.
namespace berth::commands {

void add_run(CLI::App& app, int& exit_code);
void add_runs(CLI::App& app, int& exit_code);
void add_up(CLI::App& app, int& exit_code);
void add_attach(CLI::App& app, int& exit_code);
void add_stop(CLI::App& app, int& exit_code);
void add_calibrate(CLI::App& app, int& exit_code);
void add_campaign(CLI::App& app, int& exit_code);
void add_check(CLI::App& app, int& exit_code);
void add_command(CLI::App& app, int& exit_code);
void add_config(CLI::App& app, int& exit_code);
void add_console(CLI::App& app, int& exit_code);
void add_compare(CLI::App& app, int& exit_code);
void add_report(CLI::App& app, int& exit_code);
void add_estimate(CLI::App& app, int& exit_code);
void add_kinematics(CLI::App& app, int& exit_code);
void add_lidar(CLI::App& app, int& exit_code);
void add_log(CLI::App& app, int& exit_code);
void add_nightly(CLI::App& app, int& exit_code);
void add_target(CLI::App& app, int& exit_code);
void add_spy(CLI::App& app, int& exit_code);
void add_picture(CLI::App& app, int& exit_code);
void add_reestimate(CLI::App& app, int& exit_code);
void add_replay(CLI::App& app, int& exit_code);
void add_doctor(CLI::App& app, int& exit_code);

}  // namespace berth::commands
