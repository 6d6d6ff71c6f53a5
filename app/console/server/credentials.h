// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace berth::console {

/// Reads a token: the first line of a file that only its owner can read, of 32 characters or more,
/// letters, digits, '-' and '_'. @throws InputError
std::string read_token(const std::filesystem::path& file);

/// @throws InputError when others than its owner can read the file, or it is not there
void require_private(const std::filesystem::path& file);

/// What another host needs to be let in.
struct Credentials {
  std::filesystem::path token;        ///< 256 random bits, as hexadecimal digits
  std::filesystem::path certificate;  ///< self-signed, P-256, for `days`
  std::filesystem::path key;
  std::string fingerprint;  ///< SHA-256 of the certificate, as browsers show it

  static constexpr int days = 825;
};

/// Makes new ones in a directory: files that only their owner can read. The certificate is for
/// these names and numeric addresses. @throws InputError when one is there already
Credentials make_credentials(const std::filesystem::path& directory,
                             const std::vector<std::string>& hosts);

}  // namespace berth::console
