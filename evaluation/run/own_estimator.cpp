// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/run/own_estimator.h"

namespace berth::evaluation {
namespace {

constexpr std::string_view prefix = "estimator: ";

bool is_own_estimator(const attachment_t& attachment) {
  return attachment.name.starts_with(prefix);
}

}  // namespace

attachment_t attachment_of_own_estimator(const std::string& name, const std::string& sha256) {
  attachment_t attachment{};
  attachment.name = std::string(prefix) + name;
  attachment.sha256 = sha256;
  return attachment;
}

std::string own_estimator_of(const run_info_t& info) {
  for (const attachment_t& attachment : info.attachments) {
    if (!is_own_estimator(attachment)) continue;
    const std::string name = attachment.name.substr(prefix.size());
    return attachment.sha256.empty() ? name : name + ", " + attachment.sha256.substr(0, 12);
  }
  return "";
}

bool forget_own_estimator(run_info_t& info) {
  const bool any = std::erase_if(info.attachments, is_own_estimator) > 0;
  info.attachment_count = static_cast<std::int32_t>(info.attachments.size());
  return any;
}

}  // namespace berth::evaluation
