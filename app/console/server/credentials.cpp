// SPDX-License-Identifier: BSD-3-Clause
#include "app/console/server/credentials.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <openssl/ec.h>
#include <openssl/pem.h>
#include <openssl/rand.h>
#include <openssl/x509v3.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <memory>

#include "common/core/error.h"
#include "common/core/file.h"

namespace berth::console {
namespace fs = std::filesystem;
namespace {

constexpr std::size_t shortest_token = 32;

template <class T, void (*release)(T*)>
struct Release {
  void operator()(T* thing) const { release(thing); }
};
using Key = std::unique_ptr<EVP_PKEY, Release<EVP_PKEY, EVP_PKEY_free>>;
using Certificate = std::unique_ptr<X509, Release<X509, X509_free>>;
using Extension = std::unique_ptr<X509_EXTENSION, Release<X509_EXTENSION, X509_EXTENSION_free>>;
using Memory = std::unique_ptr<BIO, Release<BIO, BIO_free_all>>;

void require(bool good) {
  if (!good) throw std::runtime_error("OpenSSL could not make a certificate");
}

std::string hexadecimal(const unsigned char* bytes, std::size_t size, const char* between) {
  constexpr const char* digits = "0123456789ABCDEF";
  std::string text;
  for (std::size_t i = 0; i < size; ++i) {
    if (i > 0) text += between;
    text += digits[bytes[i] >> 4U];
    text += digits[bytes[i] & 15U];
  }
  return text;
}

std::string content_of(BIO* memory) {
  char* data = nullptr;
  const auto size = BIO_get_mem_data(memory, &data);
  return {data, static_cast<std::size_t>(size)};
}

void write_private(const fs::path& file, const std::string& content) {
  const int fd = open(file.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
  if (fd < 0) throw InputError(file.string() + ": " + std::strerror(errno));
  const bool whole =
      write(fd, content.data(), content.size()) == static_cast<ssize_t>(content.size());
  if (close(fd) != 0 || !whole) throw InputError(file.string() + " could not be written");
}

std::string alternative_names(const std::vector<std::string>& hosts) {
  std::string names;
  for (const std::string& host : hosts) {
    std::array<unsigned char, sizeof(in6_addr)> bytes{};
    const bool address = inet_pton(AF_INET, host.c_str(), bytes.data()) == 1 ||
                         inet_pton(AF_INET6, host.c_str(), bytes.data()) == 1;
    const bool plain = std::all_of(host.begin(), host.end(), [](unsigned char c) {
      return std::isalnum(c) != 0 || c == '.' || c == '-' || c == ':';
    });
    if (!plain || host.empty())
      throw InputError("host '" + host + "': expected a name or an address");
    names += (names.empty() ? "" : ",") + std::string(address ? "IP:" : "DNS:") + host;
  }
  return names;
}

void add_extension(X509* certificate, int kind, const std::string& value) {
  const Extension extension(X509V3_EXT_conf_nid(nullptr, nullptr, kind, value.c_str()));
  require(extension != nullptr && X509_add_ext(certificate, extension.get(), -1) == 1);
}

Certificate sign(EVP_PKEY* key, const std::vector<std::string>& hosts) {
  Certificate certificate(X509_new());
  X509* const x509 = certificate.get();
  std::array<unsigned char, 8> serial{};
  require(RAND_bytes(serial.data(), serial.size()) == 1);
  std::uint64_t number = 0;
  std::memcpy(&number, serial.data(), sizeof number);
  constexpr long day = 86400;
  require(X509_set_version(x509, 2) == 1 &&
          ASN1_INTEGER_set_uint64(X509_get_serialNumber(x509), number >> 1U) == 1 &&
          X509_gmtime_adj(X509_getm_notBefore(x509), -day) != nullptr &&
          X509_gmtime_adj(X509_getm_notAfter(x509), Credentials::days * day) != nullptr &&
          X509_set_pubkey(x509, key) == 1);
  X509_NAME* name = X509_get_subject_name(x509);
  const auto* title = reinterpret_cast<const unsigned char*>("Berth console");
  require(X509_NAME_add_entry_by_txt(name, "CN", MBSTRING_ASC, title, -1, -1, 0) == 1 &&
          X509_set_issuer_name(x509, name) == 1);
  add_extension(x509, NID_subject_alt_name, alternative_names(hosts));
  add_extension(x509, NID_basic_constraints, "critical,CA:FALSE");
  add_extension(x509, NID_ext_key_usage, "serverAuth");
  require(X509_sign(x509, key, EVP_sha256()) > 0);
  return certificate;
}

}  // namespace

void require_private(const fs::path& file) {
  struct stat state {};
  if (stat(file.c_str(), &state) != 0)
    throw InputError(file.string() + ": " + std::strerror(errno));
  if ((state.st_mode & (S_IRWXG | S_IRWXO)) != 0) {
    throw InputError(file.string() + ": others than its owner can use it; chmod 600 " +
                     file.string());
  }
}

std::string read_token(const fs::path& file) {
  require_private(file);
  std::string token = read_file(file);
  token.erase(std::min(token.find('\n'), token.size()));
  const bool plain = std::all_of(token.begin(), token.end(), [](unsigned char c) {
    return std::isalnum(c) != 0 || c == '-' || c == '_';
  });
  if (token.size() < shortest_token || !plain) {
    throw InputError(file.string() + ": found " + std::to_string(token.size()) +
                     " characters, expected a token of " + std::to_string(shortest_token) +
                     " or more: letters, digits, '-', '_'");
  }
  return token;
}

Credentials make_credentials(const fs::path& directory, const std::vector<std::string>& hosts) {
  std::error_code error;
  fs::create_directories(directory, error);
  if (error) throw InputError("directory " + directory.string() + ": " + error.message());
  Credentials made{directory / "token", directory / "certificate.pem", directory / "key.pem", ""};

  const Key key(EVP_EC_gen("P-256"));
  require(key != nullptr);
  const Certificate certificate = sign(key.get(), hosts);
  const Memory key_text(BIO_new(BIO_s_mem()));
  const Memory certificate_text(BIO_new(BIO_s_mem()));
  require(PEM_write_bio_PrivateKey(key_text.get(), key.get(), nullptr, nullptr, 0, nullptr,
                                   nullptr) == 1 &&
          PEM_write_bio_X509(certificate_text.get(), certificate.get()) == 1);
  std::array<unsigned char, 32> random{};
  require(RAND_bytes(random.data(), random.size()) == 1);
  std::array<unsigned char, EVP_MAX_MD_SIZE> digest{};
  unsigned size = 0;
  require(X509_digest(certificate.get(), EVP_sha256(), digest.data(), &size) == 1);
  made.fingerprint = hexadecimal(digest.data(), size, ":");

  write_private(made.key, content_of(key_text.get()));
  write_private(made.certificate, content_of(certificate_text.get()));
  write_private(made.token, hexadecimal(random.data(), random.size(), "") + '\n');
  return made;
}

}  // namespace berth::console
