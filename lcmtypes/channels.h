// SPDX-License-Identifier: BSD-3-Clause
#pragma once

/// The channel table: every channel of the testbed. README has it with types and writers. One
/// writer per channel, except where the comment reads "every node".
namespace berth::channels {

// clang-format off
inline constexpr char arm_state_replica[]       = "ARM_STATE_REPLICA";       // arm_state_t, replica arm driver
inline constexpr char arm_state_sensor[]        = "ARM_STATE_SENSOR";        // arm_state_t, sensor arm driver
inline constexpr char arm_command_replica[]     = "ARM_COMMAND_REPLICA";     // arm_command_t, testbed
inline constexpr char arm_command_sensor[]      = "ARM_COMMAND_SENSOR";      // arm_command_t, testbed
inline constexpr char facility_state[]          = "FACILITY_STATE";          // facility_state_t, facility driver
inline constexpr char facility_command[]        = "FACILITY_COMMAND";        // facility_command_t, lease holder
inline constexpr char facility_answers[]        = "FACILITY_ANSWERS";        // command_answers_t, facility driver
inline constexpr char lidar_state[]             = "LIDAR_STATE";             // lidar_state_t, lidar driver
inline constexpr char scan_request[]            = "SCAN_REQUEST";            // scan_request_t, estimator
inline constexpr char scan_data[]               = "SCAN_DATA";               // scan_packet2_t, lidar driver
inline constexpr char inertial_motion[]         = "INERTIAL_MOTION";         // inertial_motion_t, the chaser's instruments
inline constexpr char estimator_command[]       = "ESTIMATOR_COMMAND";       // estimator_command_t, lease holder
inline constexpr char estimator_state[]         = "ESTIMATOR_STATE";         // estimator_state_t, estimator
inline constexpr char pose_estimate[]           = "POSE_ESTIMATE";           // pose_estimate_t, estimator
inline constexpr char estimator_diagnostics[]   = "ESTIMATOR_DIAGNOSTICS";   // estimator_diagnostics_t, estimator
inline constexpr char testbed_command[]         = "TESTBED_COMMAND";         // testbed_command2_t, lease holder
inline constexpr char testbed_state[]           = "TESTBED_STATE";           // testbed_state_t, testbed
inline constexpr char setpoint_latency[]        = "SETPOINT_LATENCY";        // setpoint_latency_t, testbed
inline constexpr char guidance_setpoint[]       = "GUIDANCE_SETPOINT";       // guidance_setpoint_t, an outside GNC
inline constexpr char guidance_state[]          = "GUIDANCE_STATE";          // guidance_state_t, testbed
inline constexpr char ground_truth[]            = "GROUND_TRUTH";            // ground_truth_t, testbed
inline constexpr char procedure_command[]       = "PROCEDURE_COMMAND";       // procedure_command_t, operator's terminal
inline constexpr char procedure_answers[]       = "PROCEDURE_ANSWERS";       // command_answers_t, engine
inline constexpr char procedure_state[]         = "PROCEDURE_STATE";         // procedure_state_t, engine
inline constexpr char operator_control[]        = "OPERATOR_CONTROL";        // operator_control_t, engine
inline constexpr char run_info[]                = "RUN_INFO";                // run_info_t, engine
inline constexpr char verdict_basis[]           = "VERDICT_BASIS";           // verdict_basis_t, engine
inline constexpr char injection[]               = "INJECTION";               // injection_t, engine
inline constexpr char injection_state[]         = "INJECTION_STATE";         // injection_state_t, simulated cell
inline constexpr char node_status[]             = "NODE_STATUS";             // node_status_t, every node
inline constexpr char heartbeat[]               = "HEARTBEAT";               // heartbeat_t, every node
inline constexpr char event[]                   = "EVENT";                   // event_t, every node
// Not on the bus: in world_truth.lcm, in the directory of a simulated cell's run.
inline constexpr char world_truth[]             = "WORLD_TRUTH";             // ground_truth_t, simulated cell
// clang-format on

}  // namespace berth::channels
