// SPDX-License-Identifier: Apache-2.0
#include "viewer.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cstring>
#include <stdexcept>

namespace velatura::test {

namespace {

/// Fields of a message, in order.
class Fields {
  public:
    explicit Fields(const std::vector<char>& bytes) : bytes_(bytes) {}

    template <class T>
    T number() {
        T value;
        need(sizeof(T));
        std::memcpy(&value, bytes_.data() + at_, sizeof(T));
        at_ += sizeof(T);
        return value;
    }

    std::string text() {
        std::string out;
        for (char c = number<char>(); c != 0; c = number<char>()) out += c;
        return out;
    }

    size_t left() const { return bytes_.size() - at_; }

  private:
    void need(size_t size) const {
        if (left() < size) throw std::runtime_error("a message is too short");
    }

    const std::vector<char>& bytes_;
    size_t at_ = 0;
};

bool is_ready(int socket, int milliseconds) {
    pollfd wanted{socket, POLLIN, 0};
    return poll(&wanted, 1, milliseconds) > 0;
}

}  // namespace

Viewer::Viewer(Mood mood) : mood_(mood) {
    socket_ = socket(AF_INET, SOCK_STREAM, 0);
    // Little room, so that a viewer that reads nothing is felt
    const int room = 4096;
    setsockopt(socket_, SOL_SOCKET, SO_RCVBUF, &room, sizeof(room));
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof(address);
    const bool is_bound = bind(socket_, reinterpret_cast<sockaddr*>(&address), size) == 0 &&
                          ::listen(socket_, 4) == 0 &&
                          getsockname(socket_, reinterpret_cast<sockaddr*>(&address), &size) == 0;
    if (!is_bound) throw std::runtime_error("no port");
    port_ = ntohs(address.sin_port);
    thread_ = std::thread([this] { listen(); });
}

Viewer::~Viewer() {
    is_ending_ = true;
    thread_.join();
    close(socket_);
}

void Viewer::listen() {
    while (!is_ending_) {
        if (!is_ready(socket_, 20)) continue;
        const int client = accept(socket_, nullptr, nullptr);
        if (client < 0) continue;
        ++connections_;
        serve(client);
        close(client);
    }
}

void Viewer::serve(int client) {
    std::vector<char> bytes;
    int messages = 0;
    while (!is_ending_) {
        if (mood_ == Mood::Stalls) {
            std::this_thread::sleep_for(std::chrono::milliseconds(10));
            continue;
        }
        if (!is_ready(client, 20)) continue;
        char chunk[4096];
        const ssize_t n = recv(client, chunk, sizeof(chunk), 0);
        if (n <= 0) return;
        bytes.insert(bytes.end(), chunk, chunk + n);
        for (uint32_t length = 0; bytes.size() >= 4;) {
            std::memcpy(&length, bytes.data(), 4);
            if (bytes.size() < length || length < 5) break;
            try {
                decode({bytes.begin() + 4, bytes.begin() + length});
            } catch (const std::exception& e) {
                const std::lock_guard lock(mutex_);
                fault_ = e.what();
            }
            bytes.erase(bytes.begin(), bytes.begin() + length);
            ++messages;
        }
        if (mood_ == Mood::ClosesOnce && connections_ == 1 && messages >= 2) return;
    }
}

void Viewer::decode(const std::vector<char>& message) {
    Fields fields(message);
    const char kind = fields.number<char>();
    fields.number<char>();  // whether it comes to the front
    const std::string name = fields.text();
    const std::lock_guard lock(mutex_);
    Image& image = images_[name];
    if (kind == 4) {
        image = {};
        image.width = fields.number<int32_t>();
        image.height = fields.number<int32_t>();
        for (int32_t c = fields.number<int32_t>(); c > 0; --c)
            image.channels[fields.text()].assign(size_t(image.width) * size_t(image.height), 0.0f);
        return;
    }
    if (kind != 6) throw std::runtime_error("an unknown kind of message");
    const auto count = size_t(fields.number<int32_t>());
    std::vector<std::string> names(count);
    for (std::string& channel : names) channel = fields.text();
    const int x = fields.number<int32_t>(), y = fields.number<int32_t>(),
              width = fields.number<int32_t>(), height = fields.number<int32_t>();
    std::vector<int64_t> offsets(count), strides(count);
    for (int64_t& offset : offsets) offset = fields.number<int64_t>();
    for (int64_t& stride : strides) stride = fields.number<int64_t>();
    std::vector<float> values(fields.left() / sizeof(float));
    for (float& value : values) value = fields.number<float>();
    if (x < 0 || y < 0 || x + width > image.width || y + height > image.height)
        throw std::runtime_error("a window beyond the image");
    for (size_t c = 0; c < count; ++c) {
        std::vector<float>& channel = image.channels.at(names[c]);
        for (int row = 0; row < height; ++row)
            for (int column = 0; column < width; ++column)
                channel[size_t(y + row) * size_t(image.width) + size_t(x + column)] =
                    values.at(size_t(offsets[c] + (int64_t(row) * width + column) * strides[c]));
    }
}

std::map<std::string, Viewer::Image> Viewer::images() {
    const std::lock_guard lock(mutex_);
    return images_;
}

std::string Viewer::fault() {
    const std::lock_guard lock(mutex_);
    return fault_;
}

}  // namespace velatura::test
