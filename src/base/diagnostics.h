// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/source_loc.h"

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

namespace velatura {

enum class Severity : uint8_t { Note, Warning, Error };

/// One thing to tell the user about their data. Messages are lower case, without a period, and say
/// found and expected.
struct Diagnostic {
    Severity severity = Severity::Error;
    std::string code;       ///< stable kebab-case word, e.g. "usd-unresolved-prim-path"
    SourceLoc loc;          ///< file:line:column, or unknown
    std::string prim_path;  ///< prim in whose service the work was done; may be empty
    std::string message;
    std::vector<std::string> notes;
};

class Diagnostics;

/// A way to a Diagnostics that may be gone when there is something to tell: for values that are
/// brought in on first use. Thread-safe.
class LateDiagnostics {
  public:
    LateDiagnostics() = default;

    /// Tells it, or forgets it when the Diagnostics is gone.
    void add(Diagnostic d) const;

  private:
    friend class Diagnostics;

    struct Link {
        std::mutex mutex;
        Diagnostics* target = nullptr;
    };

    std::shared_ptr<Link> link_;
};

/// Collects what is wrong with the user's data while the work goes on. Thread-safe.
/// Repeats of the same (code, loc, prim_path, message) are counted, not stored; a code that comes
/// more than `per_code_limit` times keeps its first entries and a count of the rest.
class Diagnostics {
  public:
    Diagnostics() = default;
    ~Diagnostics();
    Diagnostics(const Diagnostics&) = delete;
    Diagnostics& operator=(const Diagnostics&) = delete;

    /// A way to report here later; through a forwarding one, to its target.
    LateDiagnostics late();

    /// Holds back what comes until forward(), for work that goes on beside other work but whose
    /// diagnostics must come in a fixed order. Has the file ids of `target`, which must outlive it.
    explicit Diagnostics(Diagnostics& target) : target_(&target) {}

    /// Passes on to the target what was held back, and from now on at once whatever comes.
    void forward();

    static constexpr size_t per_code_limit = 1000;

    /// Registers a file name and returns its id (>= 1); the same name gives the same id.
    uint32_t file_id(std::string_view file_name);
    /// The name registered for an id; empty for 0.
    std::string file_name(uint32_t file_id) const;

    void add(Diagnostic d);
    void note(std::string code, SourceLoc loc, std::string prim_path, std::string message);
    void warn(std::string code, SourceLoc loc, std::string prim_path, std::string message);
    void error(std::string code, SourceLoc loc, std::string prim_path, std::string message);

    size_t error_count() const;
    size_t warning_count() const;
    /// Everything stored so far, in the order of arrival.
    std::vector<Diagnostic> all() const;
    /// How many entries of each code were dropped by per_code_limit.
    std::unordered_map<std::string, size_t> dropped() const;

    /// `lamp.usda:41:9: error: message [code]` followed by `  note: while composing </World/Lamp>`
    /// and the notes.
    std::string format(const Diagnostic& d) const;

    /// Called under the lock for every stored diagnostic, as it arrives; for live printing by the
    /// app.
    void set_listener(std::function<void(const Diagnostic&)> listener);

  private:
    std::string file_name_locked(uint32_t file_id) const;

    mutable std::recursive_mutex mutex_;
    std::vector<std::string> files_;
    std::unordered_map<std::string, uint32_t> file_ids_;
    std::vector<Diagnostic> entries_;
    std::unordered_map<uint64_t, size_t> seen_;
    std::unordered_map<std::string, size_t> code_counts_;
    std::unordered_map<std::string, size_t> dropped_;
    size_t errors_ = 0;
    size_t warnings_ = 0;
    std::function<void(const Diagnostic&)> listener_;
    Diagnostics* target_ = nullptr;
    std::vector<Diagnostic> held_;
    bool is_forwarding_ = false;
    std::shared_ptr<LateDiagnostics::Link> late_link_;
};

}  // namespace velatura
