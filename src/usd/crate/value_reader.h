// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "usd/crate/crate_file.h"
#include "usd/layer/value.h"

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace velatura::usd::crate {

/// Levels of dictionaries and other values within values; the text reader's limit.
inline constexpr int max_value_depth = 256;

/// Makes values of what a file's ValueReps stand for. Values share parts, so a small file can stand
/// for very much: what is copied is counted, and reading ends at a limit.
class ValueReader {
  public:
    /// `max_bytes`: what all values read by this reader may take.
    /// `is_sample`: the values are samples of time samples.
    ValueReader(CrateFilePtr file, uint64_t max_bytes, bool is_sample = false)
        : file_(std::move(file)), bytes_left_(max_bytes), is_sample_(is_sample) {}

    /// False, with problem(), when the value is corrupt or of an unknown type.
    bool read(ValueRep rep, layer::Value& out);

    const Problem& problem() const { return problem_; }

  private:
    bool fail(uint64_t at, std::string message);
    bool fail(const Cursor& c);

    bool read_deeper(ValueRep rep, layer::Value& out);
    bool read_stored(ValueRep rep, layer::Value& out);
    bool read_enumeration(ValueRep rep, layer::Value& out);
    template <class T>
    bool read_scalar(ValueRep rep, layer::Value& out);
    bool read_time_samples(Cursor& c, layer::Value& out);
    bool read_times(ValueRep rep, std::vector<double>& out);
    bool read_unregistered(Cursor& c, layer::Value& out);
    bool read_spline(Cursor& c, layer::Value& out);
    template <class T>
    bool read_list_op(Cursor& c, layer::Value& out);
    template <class T>
    bool read_vector(Cursor& c, layer::Value& out);

    /// Counts bytes that a value takes.
    bool spend(Cursor& c, uint64_t bytes);
    /// A count of items of `stored_bytes` in the file and `bytes` in memory each.
    uint64_t count(Cursor& c, uint64_t stored_bytes, uint64_t bytes);

    // Items; what is wrong is left in the cursor
    void item(Cursor& c, int32_t& out);
    void item(Cursor& c, uint32_t& out);
    void item(Cursor& c, int64_t& out);
    void item(Cursor& c, uint64_t& out);
    void item(Cursor& c, double& out);
    void item(Cursor& c, std::string& out);
    void item(Cursor& c, layer::Token& out);
    void item(Cursor& c, layer::Path& out);
    void item(Cursor& c, layer::LayerOffset& out);
    void item(Cursor& c, layer::Reference& out);
    void item(Cursor& c, layer::Payload& out);
    void item(Cursor& c, layer::UnregisteredValue& out);
    void item(Cursor& c, layer::Dictionary& out);
    void item(Cursor& c, layer::Value& out);
    template <class A, class B>
    void item(Cursor& c, std::pair<A, B>& out);
    template <class T>
    void items(Cursor& c, std::vector<T>& out);

    CrateFilePtr file_;
    uint64_t bytes_left_;
    bool is_sample_;
    int depth_ = 0;
    Problem problem_;
};

}  // namespace velatura::usd::crate
