// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <map>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

namespace velatura::test {

/// A viewer on a port of 127.0.0.1 that decodes tev's messages by their description: a length of
/// four bytes with itself in it, a kind, and fields one after the other.
class Viewer {
  public:
    /// How it treats who connects.
    enum class Mood : uint8_t {
        Reads,
        Stalls,      ///< reads nothing, as one that hangs
        ClosesOnce,  ///< leaves in the middle of the first connection's third message
    };

    explicit Viewer(Mood mood);
    ~Viewer();
    Viewer(const Viewer&) = delete;
    Viewer& operator=(const Viewer&) = delete;

    uint16_t port() const { return port_; }

    struct Image {
        int width = 0, height = 0;
        std::map<std::string, std::vector<float>> channels;  ///< [height][width]
    };

    /// By name; what was received so far.
    std::map<std::string, Image> images();

    int connections() const { return connections_; }

    /// Why a message could not be read; empty: all could.
    std::string fault();

  private:
    void listen();
    void serve(int client);
    void decode(const std::vector<char>& message);

    const Mood mood_;
    int socket_ = -1;
    uint16_t port_ = 0;
    std::atomic<bool> is_ending_ = false;
    std::atomic<int> connections_ = 0;
    std::mutex mutex_;
    std::map<std::string, Image> images_;
    std::string fault_;
    std::thread thread_;
};

}  // namespace velatura::test
