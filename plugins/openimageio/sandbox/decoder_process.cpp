// SPDX-License-Identifier: Apache-2.0
#include "plugins/openimageio/sandbox/decoder_process.h"

#include "plugins/openimageio/sandbox/request_loop.h"
#include "plugins/openimageio/sandbox/timeout.h"

#include <fmt/format.h>
#include <sys/socket.h>
#include <sys/wait.h>

#include <algorithm>
#include <array>
#include <csignal>
#include <cstring>
#include <ctime>
#include <utility>

namespace velatura::plugins::openimageio {

namespace {

/// What stays for the next answer; larger ones give it back.
constexpr size_t kept_area_bytes = piece_bytes;
/// One answer; values are asked for in pieces.
constexpr size_t max_area_bytes = size_t(1) << 30;

}  // namespace

DecoderProcess::DecoderProcess(std::shared_ptr<ForkServerProcess> fork_server,
                               const DecoderProcessLimits& limits,
                               FileDescriptor socket,
                               SharedMemory area,
                               pid_t process)
    : fork_server_(std::move(fork_server)),
      limits_(limits),
      socket_(std::move(socket)),
      area_(std::move(area)),
      process_(process) {}

Result<std::unique_ptr<DecoderProcess>> DecoderProcess::start(
    std::shared_ptr<ForkServerProcess> fork_server, const DecoderProcessLimits& limits) {
    Result<SharedMemory> area = SharedMemory::create();
    if (!area) return area.error();
    if (const Result<void> room = area->reserve(max_spec_bytes); !room) return room.error();
    std::array<int, 2> ends = {};
    if (::socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, ends.data()) != 0)
        return Error{"reader-start", fmt::format("no socket: {}", std::strerror(errno))};
    FileDescriptor socket(ends[0]);
    const FileDescriptor its_end(ends[1]);
    const Result<pid_t> process =
        fork_server->start_decoder(its_end.get(), area->descriptor(), limits.address_bytes);
    if (!process) return process.error();
    return std::unique_ptr<DecoderProcess>(new DecoderProcess(
        std::move(fork_server), limits, std::move(socket), std::move(*area), *process));
}

DecoderProcess::~DecoderProcess() {
    if (!has_ended_) (void)fork_server_->end_decoder(process_);
}

Result<size_t> DecoderProcess::ask(Request request,
                                   const PayloadSize& size,
                                   std::string_view name) {
    // Whatever ended it, it was not this request
    if (has_hung_up()) return Error{"reader-lost", how_it_ended().message};
    if (size.max > max_area_bytes)
        return Error{"image-read",
                     fmt::format("its lines or tiles are larger than {} MB", max_area_bytes >> 20)};
    const size_t room = std::max({size.max, name.size(), max_reason_bytes});
    if (room <= kept_area_bytes) area_.forget_beyond(kept_area_bytes);
    if (const Result<void> made = area_.reserve(room); !made) return made.error();
    std::copy(name.begin(), name.end(), area_.bytes().begin());
    request.serial = ++serial_;
    request.area_bytes = area_.bytes().size();
    request.name_bytes = uint32_t(name.size());
    // To one that ends at this moment nothing can be sent; why, is asked below
    (void)::send(socket_.get(), &request, sizeof request, MSG_NOSIGNAL);
    return take_answer(request, size);
}

bool DecoderProcess::has_hung_up() const {
    pollfd end = {.fd = socket_.get(), .events = POLLIN, .revents = 0};
    return ::poll(&end, 1, 0) > 0 && (end.revents & (POLLHUP | POLLERR)) != 0;
}

Result<size_t> DecoderProcess::take_answer(const Request& request, const PayloadSize& size) {
    const double begin_s = cpu_seconds();
    Timeout timeout(limits_.wall_seconds);
    bool has_exceeded_cpu = false;
    const auto continues = [&] {
        has_exceeded_cpu = cpu_seconds() - begin_s > limits_.cpu_seconds;
        return !has_exceeded_cpu;
    };
    if (!wait_to_read(socket_, timeout, continues)) {
        const double limit_s = has_exceeded_cpu ? limits_.cpu_seconds : limits_.wall_seconds;
        (void)how_it_ended();
        return Error{
            "reader-slow",
            fmt::format("decoding took more than {} s; raise --limit decode-time", limit_s)};
    }
    std::array<char, sizeof(Reply) + 1> reply = {};
    const ssize_t length = ::recv(socket_.get(), reply.data(), reply.size(), 0);
    if (length <= 0) return how_it_ended();
    Result<size_t> payload =
        payload_length(request, size, {reply.data(), size_t(length)}, area_.text());
    if (!payload && payload.error().code == "reader-answer") {
        (void)how_it_ended();
        return Error{"reader-answer",
                     fmt::format("what the decoder process answers makes no sense: {}",
                                 payload.error().message)};
    }
    return payload;
}

Error DecoderProcess::how_it_ended() {
    has_ended_ = true;
    const std::optional<int> status = fork_server_->end_decoder(process_);
    if (fork_server_->is_lost()) return {"reader-lost", "the decoder program is gone"};
    if (!status) return {"reader-ended", "the decoder process does not end"};
    if (WIFSIGNALED(*status))
        return {"reader-ended",
                fmt::format("the decoder process was ended by signal {}", WTERMSIG(*status))};
    if (WEXITSTATUS(*status) == out_of_memory_exit_code)
        return {"reader-ended", "the decoder process ran out of memory"};
    return {"reader-ended",
            fmt::format("the decoder process ended with code {}", WEXITSTATUS(*status))};
}

double DecoderProcess::cpu_seconds() const {
    clockid_t clock = {};
    timespec time = {};
    if (::clock_getcpuclockid(process_, &clock) != 0 || ::clock_gettime(clock, &time) != 0)
        return 0;
    return double(time.tv_sec) + 1e-9 * double(time.tv_nsec);
}

}  // namespace velatura::plugins::openimageio
