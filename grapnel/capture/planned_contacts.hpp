#pragma once

/// @file
/// Contacts before the planned capture: what the plan predicted against what the simulation did.

#include "grapnel/capture/capture_run.hpp"

namespace grapnel {

/// Completes PlanReport::contacts by the first contacts of the simulation before the approach ended; warns of contacts
/// that the plan does not include, and of predicted ones that do not occur; adds the row `unplanned_contact` to the
/// ledger. It fails if such a contact moved a link or a grasped target and not all grasps captured their targets. Call
/// after the monitors have written their results. No effect without contacts or without an approach.
void compare_contacts_with_plan(CaptureRun& run);

}  // namespace grapnel
