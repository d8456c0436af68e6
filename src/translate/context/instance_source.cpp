// SPDX-License-Identifier: Apache-2.0
#include "translate/context/instance_source.h"

#include "translate/context/values.h"

#include <cmath>

namespace velatura::translate {
inline namespace context {

Mat4d relative_to(const Mat4d& matrix, const Vec3d& origin) {
    Mat4d m = matrix;
    for (int i = 0; i < 3; ++i) m[3][i] -= origin[i];
    return m;
}

Mat4d between_origins(const Mat4d& matrix, const Vec3d& from, const Vec3d& to) {
    Mat4d m = matrix;
    for (int c = 0; c < 3; ++c) {
        // Sum with the rounding errors carried along. Ref: Ogita, Rump, Oishi 2005, "Accurate Sum
        // and Dot Product", SIAM J. Sci. Comput. 26(6), algorithms TwoSum, TwoProduct, Dot2
        double sum = 0.0, error = 0.0;
        const auto add = [&](double v) {
            const double next = sum + v, part = next - sum;
            error += (sum - (next - part)) + (v - part);
            sum = next;
        };
        add(matrix[3][c]);
        add(-to[c]);
        for (int r = 0; r < 3; ++r) {
            const double product = from[r] * matrix[r][c];
            add(product);
            error += std::fma(from[r], matrix[r][c], -product);
        }
        m[3][c] = sum + error;
    }
    return m;
}

void propose_origin(InstanceSource& out, const Vec3d& position) {
    if (out.is_stage || out.is_origin_fixed || !is_finite(position)) return;
    out.origin = position;
}

}  // namespace context
}  // namespace velatura::translate
