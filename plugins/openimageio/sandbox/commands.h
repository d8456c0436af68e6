// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/file_descriptor.h"

#include <sys/types.h>

#include <cstdint>
#include <optional>

namespace velatura::plugins::openimageio {

/// What the fork server is told (messages.h says what its decoders are asked).
enum class CommandKind : uint32_t {
    Start = 1,  ///< a decoder, whose socket and area come with the command
    End,        ///< a decoder: kill it if it runs, and say how it ended
};

struct Command {
    CommandKind kind = CommandKind::Start;
    int32_t process = 0;         ///< to be ended
    uint64_t address_bytes = 0;  ///< that a decoder may take beyond what the fork server has
};

struct CommandReply {
    uint32_t version = 0;  ///< protocol_version
    int32_t process = -1;  ///< that was started, or ended; -1: it could not be
    int32_t status = 0;    ///< of waitpid
    int32_t unused = 0;
};

/// The fork server finds its socket here.
inline constexpr int control_descriptor = 3;

/// Sends a command, and with Start the two files that go with it.
bool send_command(const FileDescriptor& socket,
                  const Command& command,
                  int decoder_socket = -1,
                  int area = -1);

struct ReceivedCommand {
    Command command;
    FileDescriptor decoder_socket, area;
};

/// Waits for one; nullopt when nobody can send any more, or what came is none.
std::optional<ReceivedCommand> receive_command(const FileDescriptor& socket);

}  // namespace velatura::plugins::openimageio
