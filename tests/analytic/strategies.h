// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "integrator/estimator.h"

namespace velatura::test {

inline constexpr integrator::LightSampling strategies[] = {integrator::LightSampling::Mis,
                                                           integrator::LightSampling::Light,
                                                           integrator::LightSampling::Bsdf};

inline const char* name_of(integrator::LightSampling strategy) {
    return strategy == integrator::LightSampling::Mis     ? "MIS"
           : strategy == integrator::LightSampling::Light ? "light sampling"
                                                          : "BSDF sampling";
}

}  // namespace velatura::test
