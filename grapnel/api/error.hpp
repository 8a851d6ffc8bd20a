#pragma once

/// @file
/// Errors. InputError: a file is rejected, with all errors and their places. ModelError, and std::invalid_argument in
/// general: a problem or a model contradicts itself. ControllerError: the message of a controller ends the run. A
/// numerical failure is not thrown: CaptureResult states it. Public, kept stable.

#include "grapnel/model/model.hpp"
#include "grapnel/text/faults.hpp"
