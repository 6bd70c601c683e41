#include "server/stream/login.h"

#include <openssl/crypto.h>
#include <openssl/rand.h>
#include <openssl/sha.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdio>
#include <stdexcept>

#include "server/stream/parameters.h"

namespace lumigraft::server {
namespace {

using Digest = std::array<unsigned char, SHA256_DIGEST_LENGTH>;

Digest digest_of(std::string_view text) {
  Digest digest;
  SHA256(reinterpret_cast<const unsigned char*>(text.data()), text.size(), digest.data());
  return digest;
}

std::string random_id() {
  std::array<unsigned char, 32> bytes;
  if (RAND_bytes(bytes.data(), static_cast<int>(bytes.size())) != 1) throw std::runtime_error("no random numbers");
  std::string id;
  for (const unsigned char byte : bytes) {
    std::array<char, 3> hex;
    std::snprintf(hex.data(), hex.size(), "%02x", byte);
    id += hex.data();
  }
  return id;
}

/// Of `name` in "a=1; name=VALUE; b=2", or in "a=1&name=VALUE" with `separator` '&'. Empty if it is not there.
std::string_view value_of(std::string_view name, std::string_view text, char separator) {
  while (!text.empty()) {
    const std::size_t end = std::min(text.find(separator), text.size());
    std::string_view one = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    while (one.starts_with(' ')) one.remove_prefix(1);
    if (one.starts_with(name) && one.size() > name.size() && one[name.size()] == '=')
      return one.substr(name.size() + 1);
  }
  return {};
}

/// application/x-www-form-urlencoded.
std::string decoded(std::string_view text) {
  std::string out;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '%' && i + 2 < text.size() && std::isxdigit(static_cast<unsigned char>(text[i + 1])) != 0 &&
        std::isxdigit(static_cast<unsigned char>(text[i + 2])) != 0) {
      out += static_cast<char>(std::stoi(std::string(text.substr(i + 1, 2)), nullptr, 16));
      i += 2;
    } else {
      out += text[i] == '+' ? ' ' : text[i];
    }
  }
  return out;
}

}  // namespace

/// Digests are compared, so that not even the length shows in the time.
bool Login::is_token(std::string_view text) const {
  const Digest given = digest_of(text), right = digest_of(token_);
  return CRYPTO_memcmp(given.data(), right.data(), right.size()) == 0;
}

bool Login::tries_too_often(std::string_view remote, double now_s) {
  std::erase_if(attempts_, [&](const Attempt& one) { return now_s - one.at_s > kStream.attempts_within_s; });
  while (attempts_.size() > kStream.remembered_attempts) attempts_.pop_front();
  return std::ranges::count(attempts_, remote, &Attempt::remote) >= kStream.max_attempts;
}

bool Login::authorized(std::string_view authorization, std::string_view cookies, std::string_view remote,
                       double now_s) {
  if (!required()) return true;
  constexpr std::string_view kBearer = "Bearer ";
  if (authorization.starts_with(kBearer)) {
    if (tries_too_often(remote, now_s)) return false;
    if (is_token(authorization.substr(kBearer.size()))) return true;
    attempts_.push_back({std::string(remote), now_s});
    return false;
  }
  const std::string_view id = value_of(kCookie, cookies, ';');
  std::erase_if(sessions_, [&](const Session& one) { return now_s > one.until_s; });
  const Digest given = digest_of(id);
  return std::ranges::any_of(sessions_, [&](const Session& one) {
    const Digest right = digest_of(one.id);
    return CRYPTO_memcmp(given.data(), right.data(), right.size()) == 0;
  });
}

Login::Answer Login::log_in(std::string_view form, std::string_view remote, double now_s, std::string& cookie) {
  if (tries_too_often(remote, now_s)) return Answer::too_many_attempts;
  if (!required() || !is_token(decoded(value_of("token", form, '&')))) {
    attempts_.push_back({std::string(remote), now_s});
    return Answer::wrong;
  }
  if (sessions_.size() >= kStream.max_logins) sessions_.pop_front();
  sessions_.push_back({random_id(), now_s + kStream.login_lasts_s});
  cookie = sessions_.back().id;
  return Answer::accepted;
}

}  // namespace lumigraft::server
