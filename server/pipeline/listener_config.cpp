#include "server/pipeline/listener_config.h"

#include <arpa/inet.h>
#include <openssl/pem.h>
#include <openssl/x509.h>
#include <sys/un.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdio>
#include <fstream>
#include <memory>
#include <optional>
#include <string_view>

#include "capture/error.h"
#include "capture/message_text.h"
#include "server/pipeline/parameters.h"

namespace lumigraft::server {
namespace {

/// The first line of a file that only its owner should be able to read.
std::string token_in(const capture::ConfigTable& table) {
  const std::filesystem::path file = table.existing_file("token_file");
  std::ifstream in(file);
  std::string token;
  std::getline(in, token);
  while (!token.empty() && (token.back() == '\r' || token.back() == ' ')) token.pop_back();
  if (token.size() < kPipeline.min_token_bytes)
    table.fail("token_file", "found " + std::to_string(token.size()) + " characters in the first line of " +
                                 file.filename().string() + ", allowed: " + std::to_string(kPipeline.min_token_bytes) +
                                 " or more, as of `openssl rand -hex 16`");
  return token;
}

std::vector<std::string> words(const capture::ConfigTable& table, std::string_view key) {
  return table.has(key) ? table.texts(key) : std::vector<std::string>{};
}

void check_origin(const capture::ConfigTable& table, const std::string& origin) {
  const std::size_t scheme = origin.starts_with("https://") ? 8 : origin.starts_with("http://") ? 7 : 0;
  if (scheme == 0 || origin.size() == scheme || origin.find_first_of("/ ;,'\"", scheme) != std::string::npos)
    table.fail("allowed_origins", "found \"" + origin + "\", allowed: SCHEME://HOST or SCHEME://HOST:PORT, as " +
                                      "https://museum.example");
}

ListenerSettings read_listener(const capture::ConfigTable& table) {
  ListenerSettings listener = listener_at(table.text("listen"), table.file().filename().string() + ": listen");
  if (table.has("permissions")) {
    listener.permissions = {};
    for (const std::string& word : table.texts("permissions")) {
      if (std::ranges::count(Permissions::all_names(), word) == 0)
        table.fail("permissions", "found \"" + word + "\", allowed: " + capture::listed(Permissions::all_names()));
      listener.permissions.add(Permissions::named(word));
    }
  }
  listener.allowed_hosts = words(table, "allowed_hosts");
  for (const std::string& host : listener.allowed_hosts)
    if (host.empty() || host.find_first_of(":/ ") != std::string::npos)
      table.fail("allowed_hosts", "found \"" + host + "\", allowed: a host's name, without a port");
  listener.allowed_origins = words(table, "allowed_origins");
  for (const std::string& origin : listener.allowed_origins) check_origin(table, origin);
  listener.reserved_viewers = table.integer("reserved_viewers", 0, 10000, 0);
  if (table.has("certificate") != table.has("key"))
    table.fail(table.has("key") ? "key" : "certificate", "found one of the two, allowed: certificate and key together");
  if (table.has("certificate")) {
    listener.certificate = table.existing_file("certificate");
    listener.key = table.existing_file("key");
  }
  if (table.has("token_file")) listener.token = token_in(table);
  return listener;
}

/// Days until the certificate ends; nullopt where it cannot be read, which the server says.
std::optional<int> days_left(const std::filesystem::path& certificate) {
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::fopen(certificate.c_str(), "r"), std::fclose);
  if (!file) return std::nullopt;
  const std::unique_ptr<X509, void (*)(X509*)> read(PEM_read_X509(file.get(), nullptr, nullptr, nullptr), X509_free);
  int days = 0, seconds = 0;
  if (!read || ASN1_TIME_diff(&days, &seconds, nullptr, X509_get0_notAfter(read.get())) != 1) return std::nullopt;
  return seconds < 0 ? days - 1 : days;
}

}  // namespace

ListenerSettings listener_at(const std::string& text, const std::string& where) {
  const auto refuse = [&]() {
    throw capture::InputError(where + ": found \"" + text +
                              "\", allowed: ADDRESS:PORT, as 127.0.0.1:8080, 0.0.0.0:8080, [::1]:8080 or :8080, or "
                              "unix:PATH");
  };
  ListenerSettings listener;
  constexpr std::string_view kUnix = "unix:";
  if (text.starts_with(kUnix)) {
    listener.socket = text.substr(kUnix.size());
    if (listener.socket.empty() || listener.socket.string().size() >= sizeof(sockaddr_un::sun_path)) refuse();
    return listener;
  }
  const std::size_t colon = text.rfind(':');
  if (colon == std::string::npos) refuse();
  std::string address = text.substr(0, colon);
  int port = -1;
  const char* end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data() + colon + 1, end, port);
  if (error != std::errc() || stop != end || port < 0 || port > 65535) refuse();
  if (address.empty() || address == "localhost") address = "127.0.0.1";
  if (address.size() > 2 && address.front() == '[' && address.back() == ']') {
    address = address.substr(1, address.size() - 2);
  } else if (address.find(':') != std::string::npos) {
    refuse();
  }
  std::array<unsigned char, sizeof(in6_addr)> binary{};
  if (inet_pton(AF_INET, address.c_str(), binary.data()) != 1 &&
      inet_pton(AF_INET6, address.c_str(), binary.data()) != 1) {
    refuse();
  }
  listener.address = address;
  listener.port = static_cast<std::uint16_t>(port);
  if (!listener.local()) listener.permissions = {Permission::view};
  return listener;
}

std::vector<ListenerSettings> read_listeners(const capture::ConfigTable& server, int max_viewers) {
  std::vector<ListenerSettings> listeners;
  for (const capture::ConfigTable& table : server.tables("listener")) listeners.push_back(read_listener(table));
  const std::string where = server.file().filename().string() + ": server.listen";
  if (server.has("listen")) {
    if (!listeners.empty()) server.fail("listen", "found together with [[server.listener]], allowed: one of the two");
    listeners.push_back(listener_at(server.text("listen"), where));
  }
  if (listeners.empty()) listeners.push_back(listener_at(kDefaultListen, where));
  int reserved = 0;
  for (const ListenerSettings& one : listeners) reserved += one.reserved_viewers;
  if (reserved > max_viewers)
    server.fail("max_viewers", "found " + std::to_string(max_viewers) + ", allowed: at least the " +
                                   std::to_string(reserved) + " that listeners reserve");
  return listeners;
}

std::vector<std::string> certificate_warnings(const std::vector<ListenerSettings>& listeners) {
  std::vector<std::string> warnings;
  for (const ListenerSettings& one : listeners) {
    if (!one.encrypted()) continue;
    const std::optional<int> days = days_left(one.certificate);
    if (days && *days < kPipeline.certificate_ends_soon_days)
      warnings.push_back(one.url(one.port) + ": its certificate " +
                         (*days < 0 ? std::string("has ended") : "ends in " + std::to_string(*days) + " days"));
  }
  return warnings;
}

std::vector<std::string> listener_warnings(const std::vector<ListenerSettings>& listeners) {
  std::vector<std::string> warnings;
  for (const ListenerSettings& one : listeners) {
    if (!one.token.empty() && !one.encrypted() && !one.local())
      warnings.push_back(
          one.url(one.port) +
          ": its token travels unencrypted; give it a certificate, or listen behind a proxy that has one");
  }
  for (std::string& warning : certificate_warnings(listeners)) warnings.push_back(std::move(warning));
  return warnings;
}

}  // namespace lumigraft::server
