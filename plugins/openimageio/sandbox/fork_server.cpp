// SPDX-License-Identifier: Apache-2.0
#include "plugins/openimageio/sandbox/fork_server.h"

#include "base/process/process_limits.h"
#include "plugins/openimageio/sandbox/commands.h"
#include "plugins/openimageio/sandbox/messages.h"
#include "plugins/openimageio/sandbox/request_loop.h"
#include "plugins/openimageio/sandbox/seccomp_filter.h"

#include <fcntl.h>
#include <malloc.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdio>
#include <ctime>
#include <map>
#include <new>

namespace velatura::plugins::openimageio {

namespace {

/// To the kernel: of all processes, end this one first when memory runs out.
void offer_to_be_ended() {
    const FileDescriptor score(::open("/proc/self/oom_score_adj", O_WRONLY | O_CLOEXEC));
    if (score.is_open() && ::write(score.get(), "1000", 4) < 0) return;
}

/// Takes from this process what a decoder has no need of.
void give_up_rights(uint64_t address_bytes_more) {
    offer_to_be_ended();
    // Neither a dump of what it was reading, nor a program with more rights, nor a byte in a file
    if (limits_addresses) ::prctl(PR_SET_DUMPABLE, 0);
    ::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0);
    set_limit(RLIMIT_CORE, 0);
    set_limit(RLIMIT_FSIZE, 0);
    // Each thread's own heap reserves addresses that count
    ::mallopt(M_ARENA_MAX, 2);
    if (limits_addresses) set_limit(RLIMIT_AS, address_bytes() + address_bytes_more);
    std::set_new_handler([] { ::_exit(out_of_memory_exit_code); });
    install_seccomp_filter();
}

[[noreturn]] void become_decoder(ImageSource& source,
                                 pid_t fork_server,
                                 ReceivedCommand received,
                                 FileDescriptor control) {
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    // It may have ended before that
    if (::getppid() != fork_server) ::_exit(0);
    control = FileDescriptor();
    give_up_rights(received.command.address_bytes);
    answer_requests(source, received.decoder_socket, std::move(received.area));
    ::_exit(0);
}

class ForkServer {
  public:
    ForkServer(ImageSource& source, FileDescriptor control)
        : source_(source), control_(std::move(control)), self_(::getpid()) {}

    void run() {
        // That of the renderer may be a limit on its own memory; decoders have theirs
        set_limit(RLIMIT_DATA, RLIM_INFINITY);
        reply({});
        while (std::optional<ReceivedCommand> received = receive_command(control_)) {
            note_ended();
            if (received->command.kind == CommandKind::Start)
                start(std::move(*received));
            else
                end(received->command.process);
        }
        for (const auto& [process, status] : decoders_)
            if (!status) ::kill(process, SIGKILL);
    }

  private:
    void reply(CommandReply said) {
        said.version = protocol_version;
        (void)::send(control_.get(), &said, sizeof said, MSG_NOSIGNAL);
    }

    /// What it received is the decoder's alone when this returns.
    pid_t fork_decoder(ReceivedCommand received) {
        const pid_t process = ::fork();
        if (process == 0) become_decoder(source_, self_, std::move(received), std::move(control_));
        return process;
    }

    void start(ReceivedCommand received) {
        const pid_t process = fork_decoder(std::move(received));
        if (process > 0) decoders_.emplace(process, std::nullopt);
        reply({.process = process});
    }

    void end(pid_t process) {
        const auto found = decoders_.find(process);
        if (found == decoders_.end()) return reply({});
        // Until it is waited for, its number is nobody else's
        if (!found->second) ::kill(process, SIGKILL);
        // One that waits for a file server does not end when told to; it is noted later
        const timespec pause = {.tv_sec = 0, .tv_nsec = 1'000'000};
        for (int i = 0; i < 2000 && !found->second; ++i) {
            note_ended();
            if (!found->second) ::nanosleep(&pause, nullptr);
        }
        if (!found->second) return reply({});
        reply({.process = process, .status = *found->second});
        decoders_.erase(found);
    }

    /// Waits for all that have ended.
    void note_ended() {
        int status = 0;
        pid_t process = 0;
        while ((process = ::waitpid(-1, &status, WNOHANG)) > 0) {
            const auto found = decoders_.find(process);
            if (found != decoders_.end()) found->second = status;
        }
    }

    ImageSource& source_;
    FileDescriptor control_;
    pid_t self_;
    std::map<pid_t, std::optional<int>> decoders_;  // and how they ended
};

bool is_socket(int descriptor) {
    int type = 0;
    socklen_t size = sizeof type;
    return ::getsockopt(descriptor, SOL_SOCKET, SO_TYPE, &type, &size) == 0;
}

}  // namespace

int run_fork_server(ImageSource& source) {
    if (!is_socket(control_descriptor)) {
        (void)std::fputs("This program is started by velatura, to decode images.\n", stderr);
        return 2;
    }
    ForkServer(source, FileDescriptor(control_descriptor)).run();
    return 0;
}

}  // namespace velatura::plugins::openimageio
