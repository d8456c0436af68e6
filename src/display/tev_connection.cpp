// SPDX-License-Identifier: Apache-2.0
#include "display/tev_connection.h"

#include <fmt/format.h>
#include <netdb.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <charconv>
#include <cstring>
#include <memory>

namespace velatura::display {

namespace {

using std::chrono::milliseconds;
using Clock = std::chrono::steady_clock;

/// Whether the socket takes bytes before the time is over.
bool waits_for_space(int socket, Clock::time_point end) {
    for (;;) {
        const auto left = std::chrono::duration_cast<milliseconds>(end - Clock::now()).count();
        pollfd wanted{socket, POLLOUT, 0};
        const int ready = poll(&wanted, 1, int(left < 0 ? 0 : left));
        if (ready < 0 && errno == EINTR) continue;
        return ready > 0;
    }
}

/// 0, or why it is not connected.
int connect_within(int socket, const sockaddr* to, socklen_t size_of_to, Clock::time_point end) {
    if (connect(socket, to, size_of_to) == 0) return 0;
    if (errno != EINPROGRESS) return errno;
    if (!waits_for_space(socket, end)) return ETIMEDOUT;
    int error = 0;
    socklen_t size = sizeof(error);
    if (getsockopt(socket, SOL_SOCKET, SO_ERROR, &error, &size) != 0) return errno;
    return error;
}

}  // namespace

std::string Address::text() const {
    return host.find(':') == std::string::npos ? fmt::format("{}:{}", host, port)
                                               : fmt::format("[{}]:{}", host, port);
}

Result<Address> parse_address(std::string_view text) {
    const Error wrong{"bad-address", fmt::format("expected HOST or HOST:PORT, found \"{}\"", text)};
    Address address;
    std::string_view port;
    if (text.starts_with('[')) {
        const size_t end = text.find(']');
        if (end == std::string_view::npos) return wrong;
        address.host = text.substr(1, end - 1);
        const std::string_view rest = text.substr(end + 1);
        if (!rest.empty() && rest[0] != ':') return wrong;
        port = rest.empty() ? std::string_view() : rest.substr(1);
        if (!rest.empty() && port.empty()) return wrong;
    } else {
        const size_t colon = text.find(':');
        address.host = text.substr(0, colon);
        if (colon != std::string_view::npos) {
            port = text.substr(colon + 1);
            if (port.empty()) return wrong;
        }
    }
    if (address.host.empty()) return wrong;
    if (port.empty()) return address;
    const auto [end, error] = std::from_chars(port.data(), port.data() + port.size(), address.port);
    const bool is_number = error == std::errc() && end == port.data() + port.size();
    if (!is_number || address.port == 0) return wrong;
    return address;
}

/// A socket address of any family.
struct TevConnection::Place {
    sockaddr_storage address;
    socklen_t size;
};

TevConnection::TevConnection(Address address) : address_(std::move(address)) {}

TevConnection::~TevConnection() {
    close();
}

Error TevConnection::unreachable(const char* why) const {
    return {"display-unreachable", fmt::format("no viewer at {}: {}", address_.text(), why)};
}

Result<void> TevConnection::resolve() {
    addrinfo hints{};
    hints.ai_family = AF_UNSPEC;
    hints.ai_socktype = SOCK_STREAM;
    addrinfo* found = nullptr;
    const int unknown =
        getaddrinfo(address_.host.c_str(), std::to_string(address_.port).c_str(), &hints, &found);
    if (unknown != 0) return unreachable(gai_strerror(unknown));
    const std::unique_ptr<addrinfo, decltype(&freeaddrinfo)> list(found, freeaddrinfo);
    for (const addrinfo* at = found; at; at = at->ai_next) {
        Place& place = places_.emplace_back();
        std::memcpy(&place.address, at->ai_addr, at->ai_addrlen);
        place.size = at->ai_addrlen;
    }
    return {};
}

Result<void> TevConnection::open(milliseconds patience) {
    close();
    if (places_.empty())
        if (const Result<void> resolved = resolve(); !resolved) return resolved;
    int error = EADDRNOTAVAIL;
    for (const Place& place : places_) {
        const int made =
            socket(place.address.ss_family, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
        if (made < 0) {
            error = errno;
            continue;
        }
        error = connect_within(made, reinterpret_cast<const sockaddr*>(&place.address), place.size,
                               Clock::now() + patience);
        if (error == 0) {
            socket_ = made;
            return {};
        }
        ::close(made);
    }
    return unreachable(std::strerror(error));
}

size_t TevConnection::send(std::span<const char> bytes, milliseconds patience) {
    const Clock::time_point end = Clock::now() + patience;
    size_t sent = 0;
    while (is_open() && sent < bytes.size()) {
        // A viewer that is gone must not end the program
        const ssize_t n = ::send(socket_, bytes.data() + sent, bytes.size() - sent, MSG_NOSIGNAL);
        if (n > 0) {
            sent += size_t(n);
            continue;
        }
        if (n < 0 && errno == EINTR) continue;
        const bool is_full = n < 0 && (errno == EAGAIN || errno == EWOULDBLOCK);
        if (!is_full) {
            close();
            break;
        }
        if (!waits_for_space(socket_, end)) break;
    }
    return sent;
}

void TevConnection::notice_end() {
    char dropped[256];  // a viewer has nothing to say
    while (is_open()) {
        const ssize_t n = recv(socket_, dropped, sizeof(dropped), MSG_DONTWAIT);
        if (n > 0 || (n < 0 && errno == EINTR)) continue;
        const bool is_idle = n < 0 && (errno == EAGAIN || errno == EWOULDBLOCK);
        if (!is_idle) close();
        return;
    }
}

void TevConnection::close() {
    if (socket_ >= 0) ::close(socket_);
    socket_ = -1;
}

}  // namespace velatura::display
