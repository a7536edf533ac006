#!/usr/bin/env bash
# Runs every fuzz target that the preset `fuzz` has built, on its seeds: tests/fuzz/run.sh [SECONDS a target] [TARGET ...]
# With THERMBAL_FUZZ_PROCESSOR=1 they are seconds of the processor, not of the clock: the machine may do other things meanwhile.
# New inputs go to build/fuzz/corpus, crashes to build/fuzz/findings; a finding ends with status 1.
set -euo pipefail
cd "$(dirname "$0")/../.."
seconds=${1:-10}
shift || true
here=tests/fuzz
built=build/fuzz/fuzz
targets=("$@")
if [ ${#targets[@]} -eq 0 ]; then
    for program in "$built"/fuzz_*; do targets+=("${program##*/fuzz_}"); done
fi

# Folders that hold good and refused inputs already.
seeds_of() {
    case $1 in
        profile_toml) echo config/profiles tests/config/refused_profiles ;;
        configuration_toml) echo tests/config/refused "$here/seeds/configuration_toml" ;;
        model_toml) [ -d config/models ] && echo config/models ;;
    esac
    [ -d "$here/seeds/$1" ] && echo "$here/seeds/$1"
    return 0
}

fuzz() {  # target, flags and folders...
    local target=$1
    shift
    if [ -n "${THERMBAL_FUZZ_PROCESSOR:-}" ]; then
        "$here/processor_seconds.py" "$seconds" "$built/fuzz_$target" "$@"
    else
        "$built/fuzz_$target" -max_total_time="$seconds" "$@"
    fi
}

run_one() {
    local target=$1 corpus=build/fuzz/corpus/$1 findings=build/fuzz/findings/
    mkdir -p "$corpus" "$findings"
    local hang_s=10
    # By the clock: a machine that does other things meanwhile makes an input wait.
    [ -n "${THERMBAL_FUZZ_PROCESSOR:-}" ] && hang_s=120
    local flags=(-timeout=$hang_s -rss_limit_mb=2048 -max_len=4096 -print_final_stats=1
                 -artifact_prefix="$findings$target-")
    case $target in *_toml | sim_scenario) flags+=(-dict="$here/toml.dict") ;; esac
    local seeds
    seeds=$(seeds_of "$target" | tr ' ' '\n' | sort -u | while read -r folder; do [ -d "$folder" ] && echo "$folder"; done)
    local TIMEFORMAT='%0U %0S' processor_s status=0
    # shellcheck disable=SC2086  # folders without blanks, several of them
    processor_s=$({ time fuzz "$target" "${flags[@]}" "$corpus" $seeds > "build/fuzz/$target.log" 2>&1; } 2>&1) || status=1
    processor_s=$((${processor_s/ / + }))
    if [ $status = 0 ]; then
        echo "ok   $target: $(grep -o 'number_of_executed_units: *[0-9]*' "build/fuzz/$target.log" | grep -o '[0-9]*$') inputs," \
            "$processor_s s of processor"
    else
        echo "FAIL $target: see build/fuzz/$target.log; $(grep -o 'Test unit written to .*' "build/fuzz/$target.log" || true)"
    fi
    return $status
}

# Two at a time: what is found does not depend on it.
status=0
for target in "${targets[@]}"; do
    while [ "$(jobs -rp | wc -l)" -ge 2 ]; do wait -n || status=1; done
    run_one "$target" &
done
while [ "$(jobs -rp | wc -l)" -gt 0 ]; do wait -n || status=1; done
exit $status
