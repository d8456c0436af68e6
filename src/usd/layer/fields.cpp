// SPDX-License-Identifier: Apache-2.0
#include "usd/layer/fields.h"

namespace velatura::usd::layer {

const FieldNames& fields() {
    static const FieldNames* const names = new FieldNames;
    return *names;
}

}  // namespace velatura::usd::layer
