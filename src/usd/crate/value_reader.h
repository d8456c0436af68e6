// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "usd/crate/crate_file.h"
#include "usd/crate/field_reader.h"
#include "usd/crate/scalar_reader.h"
#include "usd/crate/value_context.h"
#include "usd/layer/value.h"

#include <cstdint>
#include <utility>

namespace velatura::usd::crate {

/// Makes values of what a file's ValueReps stand for.
class ValueReader {
  public:
    /// `max_bytes`: what all values read by this reader may take.
    /// `is_sample`: the values are samples of time samples.
    ValueReader(CrateFilePtr file, uint64_t max_bytes, bool is_sample = false)
        : context_{std::move(file), max_bytes, is_sample, 0, {}},
          scalars_(context_),
          fields_(context_, *this) {}

    ValueReader(const ValueReader&) = delete;
    ValueReader& operator=(const ValueReader&) = delete;

    /// False, with problem(), when the value is corrupt or of an unknown type.
    bool read(ValueRep rep, layer::Value& out);

    const Problem& problem() const { return context_.problem; }

  private:
    bool read_deeper(ValueRep rep, layer::Value& out);

    ValueContext context_;
    ScalarReader scalars_;
    FieldReader fields_;
};

}  // namespace velatura::usd::crate
