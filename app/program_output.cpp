// SPDX-License-Identifier: BSD-3-Clause
#include "app/program_output.h"

#include <fcntl.h>
#include <poll.h>
#include <spawn.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>

#include "common/core/error.h"

namespace berth {
namespace {

/// Both at once: a program that fills one while we wait for the other would wait for ever.
void read_both(std::array<pollfd, 2>& from, ProgramOutput& into) {
  const std::array<std::string*, 2> texts = {&into.text, &into.errors};
  while (from[0].fd >= 0 || from[1].fd >= 0) {
    if (poll(from.data(), from.size(), -1) < 0 && errno != EINTR) return;
    for (std::size_t i = 0; i < from.size(); ++i) {
      if (from[i].fd < 0 || from[i].revents == 0) continue;
      char bytes[4096];
      const ssize_t count = read(from[i].fd, bytes, sizeof bytes);
      if (count > 0) texts[i]->append(bytes, static_cast<std::size_t>(count));
      if (count == 0 || (count < 0 && errno != EINTR)) {
        close(from[i].fd);
        from[i].fd = -1;  // poll leaves it out
      }
    }
  }
}

}  // namespace

ProgramOutput run_program(const std::vector<std::string>& arguments) {
  std::vector<char*> argv;
  for (const std::string& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
  argv.push_back(nullptr);
  int out[2];
  int err[2];
  if (pipe2(out, O_CLOEXEC) != 0 || pipe2(err, O_CLOEXEC) != 0) {
    throw InputError(arguments.front() + ": no pipe: " + strerror(errno));
  }
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, out[1], STDOUT_FILENO);
  posix_spawn_file_actions_adddup2(&actions, err[1], STDERR_FILENO);
  pid_t child = -1;
  const int error = posix_spawnp(&child, argv[0], &actions, nullptr, argv.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  close(out[1]);
  close(err[1]);
  ProgramOutput output;
  std::array<pollfd, 2> from = {{{out[0], POLLIN, 0}, {err[0], POLLIN, 0}}};
  if (error != 0) {
    close(out[0]);
    close(err[0]);
    throw InputError(arguments.front() + ": cannot be started: " + strerror(error));
  }
  read_both(from, output);
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  output.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  return output;
}

}  // namespace berth
