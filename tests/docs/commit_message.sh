#!/usr/bin/env bash
# Messages that scripts/commit-msg must accept and reject.
set -euo pipefail
hook=$1
file=$(mktemp)
trap 'rm -f "$file"' EXIT
failures=0

# expect STATUS MESSAGE
expect() {
  local status=0
  printf '%b' "$2" >"$file"
  "$hook" "$file" 2>/dev/null || status=$?
  [[ $status -eq $1 ]] || { printf 'exit status %d, expected %d: %s\n' "$status" "$1" "$2"; failures=$((failures + 1)); }
}

expect 0 'plan: Reject unreachable windows within 0.5 s\n'
expect 0 'plan, approach: Rename the trajectory\n\nThe glossary demands it.\n'
expect 0 '# a comment of git\nplan: Reject unreachable windows\n# another\n\nReason.\n'
expect 0 "Merge branch 'x'\n"
expect 0 'Revert "plan: Reject unreachable windows"\n'
expect 0 'fixup! plan: Reject unreachable windows\n'
expect 1 'plan: reject unreachable windows\n'
expect 1 'Reject unreachable windows\n'
expect 1 'plan: Reject unreachable windows.\n'
expect 1 'plan: Reject unreachable windows\nThe second line must be empty.\n'
expect 1 "plan: Reject $(printf 'x%.0s' {1..70})\n"
expect 1 '\n'
exit $((failures > 0))
