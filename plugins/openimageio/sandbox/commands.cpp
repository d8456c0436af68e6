// SPDX-License-Identifier: Apache-2.0
#include "plugins/openimageio/sandbox/commands.h"

#include <sys/socket.h>

#include <array>
#include <cerrno>
#include <cstring>

namespace velatura::plugins::openimageio {

namespace {

using TwoFiles = std::array<int, 2>;

/// A message of one command, with room for two files beside it.
class Envelope {
  public:
    explicit Envelope(Command& command) : part_{&command, sizeof command} {
        header_.msg_iov = &part_;
        header_.msg_iovlen = 1;
        header_.msg_control = room_.data();
        header_.msg_controllen = room_.size();
    }

    Envelope(const Envelope&) = delete;
    Envelope& operator=(const Envelope&) = delete;

    msghdr* header() { return &header_; }

    void omit_files() { header_.msg_controllen = 0; }

    void put(const TwoFiles& files) {
        cmsghdr* const control = CMSG_FIRSTHDR(&header_);
        control->cmsg_level = SOL_SOCKET;
        control->cmsg_type = SCM_RIGHTS;
        control->cmsg_len = CMSG_LEN(sizeof files);
        std::memcpy(CMSG_DATA(control), &files, sizeof files);
    }

    std::optional<TwoFiles> files() {
        const cmsghdr* const control = CMSG_FIRSTHDR(&header_);
        TwoFiles files = {};
        if (control == nullptr || control->cmsg_type != SCM_RIGHTS ||
            control->cmsg_len != CMSG_LEN(sizeof files))
            return std::nullopt;
        std::memcpy(&files, CMSG_DATA(control), sizeof files);
        return files;
    }

  private:
    iovec part_;
    msghdr header_ = {};
    alignas(cmsghdr) std::array<char, CMSG_SPACE(sizeof(TwoFiles))> room_ = {};
};

}  // namespace

bool send_command(const FileDescriptor& socket,
                  const Command& command,
                  int decoder_socket,
                  int area) {
    Command copy = command;
    Envelope envelope(copy);
    if (command.kind == CommandKind::Start)
        envelope.put({decoder_socket, area});
    else
        envelope.omit_files();
    return ::sendmsg(socket.get(), envelope.header(), MSG_NOSIGNAL) == ssize_t(sizeof copy);
}

std::optional<ReceivedCommand> receive_command(const FileDescriptor& socket) {
    ReceivedCommand received;
    Envelope envelope(received.command);
    ssize_t n = -1;
    while ((n = ::recvmsg(socket.get(), envelope.header(), MSG_CMSG_CLOEXEC)) < 0 &&
           errno == EINTR) {
    }
    if (n != ssize_t(sizeof received.command)) return std::nullopt;
    if (const std::optional<TwoFiles> files = envelope.files()) {
        received.decoder_socket = FileDescriptor((*files)[0]);
        received.area = FileDescriptor((*files)[1]);
    }
    return received;
}

}  // namespace velatura::plugins::openimageio
