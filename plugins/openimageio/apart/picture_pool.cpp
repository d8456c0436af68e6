// SPDX-License-Identifier: Apache-2.0
#include "plugins/openimageio/apart/picture_pool.h"

#include "plugins/openimageio/apart/messages.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstring>
#include <exception>
#include <thread>
#include <utility>

namespace velatura::plugins::openimageio {

/// Place for one reader at a time.
struct PicturePool::Seat {
    std::mutex mutex;  // of the next three
    std::unique_ptr<ReaderProcess> reader;
    uint64_t generation = 0;   // which reader it is
    size_t open_pictures = 0;  // in that reader
    std::atomic<pid_t> process{0};
    size_t pictures = 0;  // that belong here; of the pool's mutex

    Result<void> take(Result<std::unique_ptr<ReaderProcess>> started) {
        if (!started) return started.error();
        reader = std::move(*started);
        process = reader->process();
        ++generation;
        return {};
    }

    void lose_reader() {
        process = 0;
        reader.reset();
        open_pictures = 0;
    }
};

/// A picture of the pool, in whichever reader has its seat.
struct PicturePool::Visit {
    Seat& seat;
    std::string asset;
    PictureUse use;
    uint64_t picture = 0;
    uint64_t generation = 0;  // of the reader that has opened it; 0: none
    PictureSpec spec = {};    // once it was opened
};

namespace {

/// Whether the reader can be asked no more.
bool is_end(const Error& error) {
    return error.code.starts_with("reader-") && error.code != "reader-start";
}

Result<PictureSpec> ask_for_spec(ReaderProcess& reader,
                                 const Request& request,
                                 const std::string& asset) {
    const Result<size_t> length = reader.ask(request, {1, most_spec_bytes}, asset);
    if (!length) return length.error();
    // Copied first: what is in the area may change
    return spec_of(std::string(reader.area().substr(0, *length)));
}

Result<void> ask_for_values(ReaderProcess& reader,
                            const Request& request,
                            std::span<float> values) {
    const size_t bytes = values.size_bytes();
    const Result<size_t> length = reader.ask(request, {bytes, bytes});
    if (!length) return length.error();
    std::memcpy(values.data(), reader.area().data(), bytes);
    return {};
}

}  // namespace

class PicturePool::OpenPicture final : public SourcePicture {
  public:
    OpenPicture(PicturePool& pool, Visit visit) : pool_(pool), visit_(std::move(visit)) {}

    OpenPicture(const OpenPicture&) = delete;
    OpenPicture& operator=(const OpenPicture&) = delete;

    ~OpenPicture() override {
        try {
            pool_.close(visit_);
        } catch (const std::exception&) {
            // For want of memory: it stays open in its reader, whose end closes it
        }
        pool_.leave(visit_.seat);
    }

    const PictureSpec& spec() const override { return visit_.spec; }

    Result<void> open() { return pool_.read(visit_, {}, {}); }

    Result<void> read_lines(
        int level, int y, int y_end, int channels, std::span<float> values) override {
        return pool_.read(visit_,
                          {.kind = RequestKind::ReadLines,
                           .level = level,
                           .channels = channels,
                           .y = y,
                           .y_end = y_end},
                          values);
    }

    Result<void> read_tile(
        int level, int x, int y, int channels, std::span<float> values) override {
        return pool_.read(
            visit_,
            {.kind = RequestKind::ReadTile, .level = level, .channels = channels, .x = x, .y = y},
            values);
    }

  private:
    PicturePool& pool_;
    Visit visit_;
};

PicturePool::PicturePool(PoolOptions options) : options_(std::move(options)) {
    size_t count = options_.most_readers;
    if (count == 0) count = std::max(1u, std::thread::hardware_concurrency());
    for (size_t i = 0; i < count; ++i) seats_.push_back(std::make_unique<Seat>());
}

PicturePool::~PicturePool() = default;

void PicturePool::limit(const ReaderLimits& limits) {
    const std::lock_guard lock(mutex_);
    options_.limits = limits;
}

ReaderLimits PicturePool::reader_limits() const {
    const std::lock_guard lock(mutex_);
    return options_.limits;
}

std::vector<pid_t> PicturePool::processes() const {
    const std::lock_guard lock(starter_mutex_);
    std::vector<pid_t> all;
    if (starter_) all.push_back(starter_->process());
    for (const auto& seat : seats_)
        if (seat->process != 0) all.push_back(seat->process);
    return all;
}

PicturePool::Visit PicturePool::new_visit(const std::string& asset, PictureUse use) {
    const std::lock_guard lock(mutex_);
    Seat& emptiest =
        **std::min_element(seats_.begin(), seats_.end(),
                           [](const auto& a, const auto& b) { return a->pictures < b->pictures; });
    ++emptiest.pictures;
    return {.seat = emptiest, .asset = asset, .use = use, .picture = next_picture_++};
}

void PicturePool::leave(Seat& seat) {
    const std::lock_guard lock(mutex_);
    --seat.pictures;
}

std::optional<Error> PicturePool::failure_of(const std::string& asset) const {
    const std::lock_guard lock(mutex_);
    const auto found = failures_.find(asset);
    return found == failures_.end() ? std::nullopt : std::optional(found->second);
}

Error PicturePool::remember(const std::string& asset, const Error& why) {
    const std::lock_guard lock(mutex_);
    return failures_.try_emplace(asset, Error{"image-read", why.message}).first->second;
}

Result<std::shared_ptr<StarterProcess>> PicturePool::starter() {
    const std::lock_guard lock(starter_mutex_);
    if (starter_ && !starter_->is_lost()) return starter_;
    if (::access(options_.program.c_str(), X_OK) != 0)
        return Error{"reader-start",
                     fmt::format("the program {}, which reads pictures, is missing: {}",
                                 options_.program, std::strerror(errno))};
    Result<std::shared_ptr<StarterProcess>> started = StarterProcess::start(options_.program);
    if (started) starter_ = *started;
    return started;
}

Result<std::unique_ptr<SourcePicture>> PicturePool::open(const std::string& asset, PictureUse use) {
    if (asset.size() > most_name_bytes) return Error{"image-open", "its name is too long"};
    auto picture = std::make_unique<OpenPicture>(*this, new_visit(asset, use));
    if (const Result<void> opened = picture->open(); !opened)
        return Error{"image-open", opened.error().message};
    return std::unique_ptr<SourcePicture>(std::move(picture));
}

Result<void> PicturePool::enter(Visit& visit) {
    Seat& seat = visit.seat;
    if (!seat.reader) {
        const Result<std::shared_ptr<StarterProcess>> from = starter();
        if (!from) return from.error();
        const Result<void> taken = seat.take(ReaderProcess::start(*from, reader_limits()));
        if (!taken) return taken;
    }
    if (visit.generation == seat.generation) return {};
    ++seat.open_pictures;
    Result<PictureSpec> spec = ask_for_spec(
        *seat.reader, {.kind = RequestKind::Open, .picture = visit.picture, .use = visit.use},
        visit.asset);
    if (!spec) {
        if (!is_end(spec.error())) --seat.open_pictures;
        return spec.error();
    }
    visit.generation = seat.generation;
    const bool is_new = visit.spec.levels.empty();
    if (!is_new && visit.spec != *spec)
        return remember(visit.asset, {"image-read", "the file has changed since it was opened"});
    visit.spec = std::move(*spec);
    return {};
}

Result<void> PicturePool::read(Visit& visit, const Request& request, std::span<float> values) {
    constexpr int most_attempts = 3;
    Seat& seat = visit.seat;
    const std::lock_guard lock(seat.mutex);
    for (int attempt = 1;; ++attempt) {
        if (const std::optional<Error> failure = failure_of(visit.asset)) return *failure;
        Result<void> done = enter(visit);
        if (done && !values.empty()) {
            Request numbered = request;
            numbered.picture = visit.picture;
            done = ask_for_values(*seat.reader, numbered, values);
        }
        if (done || !is_end(done.error())) return done;
        const std::string& code = done.error().code;
        // Another picture of that reader may have done it: the next reader has this one alone
        const bool is_doubtful = code != "reader-slow" && attempt == 1 && seat.open_pictures > 1;
        seat.lose_reader();
        const bool is_tried_again = code == "reader-lost" || is_doubtful;
        if (!is_tried_again || attempt == most_attempts) return remember(visit.asset, done.error());
    }
}

void PicturePool::close(const Visit& visit) {
    Seat& seat = visit.seat;
    const std::lock_guard lock(seat.mutex);
    if (!seat.reader || visit.generation != seat.generation) return;
    const Result<size_t> closed =
        seat.reader->ask({.kind = RequestKind::Close, .picture = visit.picture}, {0, 0});
    if (!closed && is_end(closed.error()))
        seat.lose_reader();
    else
        --seat.open_pictures;
}

}  // namespace velatura::plugins::openimageio
