// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace velatura::display {

/// Where a viewer listens.
struct Address {
    std::string host;
    uint16_t port = 14158;  ///< tev's own

    std::string text() const;
};

/// `HOST`, `HOST:PORT`, `[IPV6]:PORT`. Errors: "bad-address".
Result<Address> parse_address(std::string_view text);

/// A TCP connection to a viewer. No call blocks for longer than it is given, but for the first
/// open(), which asks what address the host's name stands for.
class TevConnection {
  public:
    explicit TevConnection(Address address);
    ~TevConnection();

    TevConnection(const TevConnection&) = delete;
    TevConnection& operator=(const TevConnection&) = delete;

    bool is_open() const { return socket_ >= 0; }

    /// Closes it if the viewer did, which a send would only notice later.
    void notice_end();

    /// Patience is for each address that the host has. Errors: "display-unreachable", with the
    /// reason.
    Result<void> open(std::chrono::milliseconds patience);

    /// How many of the bytes the viewer took within that time; 0 where it takes none. A viewer
    /// that is gone closes the connection.
    size_t send(std::span<const char> bytes, std::chrono::milliseconds patience);

    void close();

  private:
    Result<void> resolve();
    Error unreachable(const char* why) const;

    const Address address_;
    struct Place;
    std::vector<Place> places_;  ///< of the host; found once
    int socket_ = -1;
};

}  // namespace velatura::display
