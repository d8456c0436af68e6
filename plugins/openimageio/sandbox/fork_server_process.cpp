// SPDX-License-Identifier: Apache-2.0
#include "plugins/openimageio/sandbox/fork_server_process.h"

#include "plugins/openimageio/sandbox/commands.h"
#include "plugins/openimageio/sandbox/messages.h"
#include "plugins/openimageio/sandbox/timeout.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/socket.h>
#include <sys/wait.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <ctime>
#include <utility>

namespace velatura::plugins::openimageio {

namespace {

/// To load its libraries from a slow disk; its other answers take milliseconds.
constexpr double max_answer_seconds = 120;

Error not_started(const std::string& program, const std::string& why) {
    return {"reader-start",
            fmt::format("the decoder program {} cannot be started: {}", program, why)};
}

/// What the fork server has of the renderer: one socket, and a terminal that says nothing.
class SpawnSettings {
  public:
    explicit SpawnSettings(int control) {
        posix_spawn_file_actions_init(&actions_);
        posix_spawnattr_init(&attributes_);
        for (const int standard : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO})
            posix_spawn_file_actions_addopen(&actions_, standard, "/dev/null", O_RDWR, 0);
        posix_spawn_file_actions_adddup2(&actions_, control, control_descriptor);
        posix_spawn_file_actions_addclosefrom_np(&actions_, control_descriptor + 1);
        set_signals();
    }

    SpawnSettings(const SpawnSettings&) = delete;
    SpawnSettings& operator=(const SpawnSettings&) = delete;

    ~SpawnSettings() {
        posix_spawn_file_actions_destroy(&actions_);
        posix_spawnattr_destroy(&attributes_);
    }

    const posix_spawn_file_actions_t* actions() const { return &actions_; }

    const posix_spawnattr_t* attributes() const { return &attributes_; }

  private:
    /// Whoever ends a render may tell its whole group, or all of a job, to end. The renderer goes
    /// on for a while then, and needs its images: they end with it.
    void set_signals() {
        sigset_t blocked, handled;
        sigemptyset(&blocked);
        for (const int signal :
             {SIGHUP, SIGINT, SIGQUIT, SIGTERM, SIGUSR1, SIGUSR2, SIGALRM, SIGTSTP})
            sigaddset(&blocked, signal);
        sigfillset(&handled);
        posix_spawnattr_setsigmask(&attributes_, &blocked);
        posix_spawnattr_setsigdefault(&attributes_, &handled);
        posix_spawnattr_setpgroup(&attributes_, 0);
        posix_spawnattr_setflags(
            &attributes_, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF | POSIX_SPAWN_SETPGROUP);
    }

    posix_spawn_file_actions_t actions_ = {};
    posix_spawnattr_t attributes_ = {};
};

/// Its end is closed here, so that it is nobody's when the program has ended.
Result<pid_t> spawn(const std::string& program, FileDescriptor low_end) {
    // Above those that are opened anew, which a renderer without a terminal may have free
    const FileDescriptor its_end(::fcntl(low_end.get(), F_DUPFD_CLOEXEC, control_descriptor + 1));
    const SpawnSettings settings(its_end.get());
    std::string name = program;
    const std::array<char*, 2> arguments = {name.data(), nullptr};
    pid_t process = -1;
    const int error = ::posix_spawn(&process, program.c_str(), settings.actions(),
                                    settings.attributes(), arguments.data(), environ);
    if (error != 0) return not_started(program, std::strerror(error));
    return process;
}

}  // namespace

ForkServerProcess::ForkServerProcess(pid_t process, FileDescriptor control)
    : process_(process), control_(std::move(control)) {}

Result<std::shared_ptr<ForkServerProcess>> ForkServerProcess::start(const std::string& program) {
    std::array<int, 2> ends = {};
    if (::socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, ends.data()) != 0)
        return not_started(program, std::strerror(errno));
    FileDescriptor control(ends[0]);
    const Result<pid_t> process = spawn(program, FileDescriptor(ends[1]));
    if (!process) return process.error();
    const std::shared_ptr<ForkServerProcess> fork_server(
        new ForkServerProcess(*process, std::move(control)));
    if (!fork_server->next_answer())
        return not_started(program, "it does not respond, or is of another version");
    return fork_server;
}

ForkServerProcess::~ForkServerProcess() {
    control_ = FileDescriptor();
    // It ends by itself, unless somebody has stopped it
    const timespec pause = {.tv_sec = 0, .tv_nsec = 1'000'000};
    for (int i = 0; i < 1000; ++i) {
        if (::waitpid(process_, nullptr, WNOHANG) != 0) return;
        ::nanosleep(&pause, nullptr);
    }
    ::kill(process_, SIGKILL);
    ::waitpid(process_, nullptr, 0);
}

std::optional<ForkServerProcess::Answer> ForkServerProcess::next_answer() {
    CommandReply said;
    Timeout timeout(max_answer_seconds);
    const bool is_said = wait_to_read(control_, timeout) &&
                         ::recv(control_.get(), &said, sizeof said, 0) == ssize_t(sizeof said) &&
                         said.version == protocol_version;
    // What it says after that would answer another question
    if (!is_said) {
        is_lost_ = true;
        return std::nullopt;
    }
    return Answer{said.process, said.status};
}

Result<pid_t> ForkServerProcess::start_decoder(int socket, int area, uint64_t address_bytes) {
    const std::lock_guard lock(mutex_);
    const Command command = {.kind = CommandKind::Start, .address_bytes = address_bytes};
    if (is_lost_ || !send_command(control_, command, socket, area)) is_lost_ = true;
    const std::optional<Answer> answer = is_lost_ ? std::nullopt : next_answer();
    if (answer && answer->process > 0) return answer->process;
    return Error{"reader-start",
                 answer ? "the system starts no further process" : "the decoder program is gone"};
}

std::optional<int> ForkServerProcess::end_decoder(pid_t process) {
    const std::lock_guard lock(mutex_);
    const Command command = {.kind = CommandKind::End, .process = process};
    if (is_lost_ || !send_command(control_, command)) is_lost_ = true;
    const std::optional<Answer> answer = is_lost_ ? std::nullopt : next_answer();
    if (!answer || answer->process != process) return std::nullopt;
    return answer->status;
}

bool ForkServerProcess::is_lost() const {
    const std::lock_guard lock(mutex_);
    return is_lost_;
}

}  // namespace velatura::plugins::openimageio
