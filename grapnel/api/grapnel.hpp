#pragma once

/// @file
/// All headers of this folder, the API for programs that use the library: docs/how-to/use-the-library.md lists them.
/// They reach no other header than those of plain data and of the functions that they document.
/// Public, kept stable.

#include "grapnel/api/campaign.hpp"
#include "grapnel/api/capture.hpp"
#include "grapnel/api/controller.hpp"
#include "grapnel/api/dynamics_derivatives.hpp"
#include "grapnel/api/error.hpp"
#include "grapnel/api/linearization.hpp"
#include "grapnel/api/mechanics.hpp"
#include "grapnel/api/model.hpp"
#include "grapnel/api/problem.hpp"
#include "grapnel/api/report.hpp"
#include "grapnel/api/result.hpp"
#include "grapnel/api/scenario.hpp"
#include "grapnel/api/version.hpp"
