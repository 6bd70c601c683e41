#pragma once
// A certificate that signs itself, for tests of encryption.
#include <filesystem>
#include <string>

namespace lumigraft::server {

/// Writes certificate and key as PEM files; it ends in so many days, which may be negative.
void write_test_certificate(const std::filesystem::path& certificate, const std::filesystem::path& key,
                            const std::string& host, int days);

}  // namespace lumigraft::server
