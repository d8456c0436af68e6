// SPDX-License-Identifier: Apache-2.0
#include "plugins/openimageio/sandbox/request_loop.h"

#include "plugins/openimageio/sandbox/messages.h"
#include "plugins/openimageio/sandbox/shared_memory.h"

#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <exception>
#include <new>
#include <unordered_map>
#include <utility>

namespace velatura::plugins::openimageio {

namespace {

class RequestHandler {
  public:
    RequestHandler(ImageSource& source, FileDescriptor area)
        : source_(source), area_(std::move(area)) {}

    Reply answer(const Request& request) {
        Result<size_t> done = Error{"image-read", ""};
        try {
            done = perform(request);
        } catch (const std::bad_alloc&) {
            ::_exit(out_of_memory_exit_code);
        } catch (const std::exception& e) {
            done = Error{"image-read", e.what()};
        }
        Reply reply;
        reply.serial = request.serial;
        if (done)
            reply.bytes = *done;
        else
            reject(done.error().message, reply);
        return reply;
    }

  private:
    /// Returns: bytes of the answer, which lies in the area.
    Result<size_t> perform(const Request& request) {
        if (request.version != protocol_version)
            return Error{"image-read", "the decoder program is of another version"};
        if (!area_.map(request.area_bytes)) ::_exit(out_of_memory_exit_code);
        if (request.kind == RequestKind::Open) return open(request);
        const auto found = images_.find(request.image);
        if (found == images_.end()) return Error{"image-read", "it is not open"};
        if (request.kind == RequestKind::Close) {
            images_.erase(found);
            return size_t(0);
        }
        return read(*found->second, request);
    }

    Result<size_t> open(const Request& request) {
        const std::string name(area_.text().substr(0, request.name_bytes));
        Result<std::unique_ptr<SourceImage>> opened = source_.open(name, request.use);
        if (!opened) return opened.error();
        const std::string bytes = spec_bytes((*opened)->spec());
        if (bytes.size() > area_.bytes().size())
            return Error{"image-read", "its answer is too long"};
        std::memcpy(area_.bytes().data(), bytes.data(), bytes.size());
        images_.insert_or_assign(request.image, std::move(*opened));
        return bytes.size();
    }

    Result<size_t> read(SourceImage& image, const Request& request) {
        const LevelSpec& level = image.spec().levels.at(size_t(request.level));
        const bool is_tile = request.kind == RequestKind::ReadTile;
        const size_t width = size_t(is_tile ? level.tile_width : level.width);
        const size_t height = size_t(is_tile ? level.tile_height : request.y_end - request.y);
        const size_t count = width * height * size_t(request.channels);
        if (count * sizeof(float) > area_.bytes().size())
            return Error{"image-read", "its values do not fit"};
        const std::span<float> values(reinterpret_cast<float*>(area_.bytes().data()), count);
        const Result<void> done =
            is_tile ? image.read_tile(request.level, request.x, request.y, request.channels, values)
                    : image.read_lines(request.level, request.y, request.y_end, request.channels,
                                       values);
        if (!done) return done.error();
        return values.size_bytes();
    }

    void reject(const std::string& why, Reply& reply) {
        const std::string reason = plain_reason(why);
        reply.status = ReplyStatus::Refused;
        reply.bytes = std::min(reason.size(), area_.bytes().size());
        std::memcpy(area_.bytes().data(), reason.data(), reply.bytes);
    }

    ImageSource& source_;
    SharedMemory area_;
    std::unordered_map<uint64_t, std::unique_ptr<SourceImage>> images_;
};

}  // namespace

void answer_requests(ImageSource& source, const FileDescriptor& socket, FileDescriptor area) {
    RequestHandler decoder(source, std::move(area));
    for (;;) {
        Request request;
        const ssize_t n = ::recv(socket.get(), &request, sizeof request, 0);
        if (n < 0 && errno == EINTR) continue;
        if (n != ssize_t(sizeof request)) return;
        const Reply reply = decoder.answer(request);
        if (::send(socket.get(), &reply, sizeof reply, MSG_NOSIGNAL) < 0) return;
    }
}

}  // namespace velatura::plugins::openimageio
