#!/bin/sh
# Builds one MT file of a volume in parts, several at a time, each step a process of its own: what the Snakefile beside this does,
# for machines without Snakemake. Give the same command again after a crash: files that are there are not made again.
set -eu

usage() {
    cat >&2 <<'END'
usage: build-in-parts.sh --parts N -o OUT.mt [--jobs N] [--folder DIR] [--command PROGRAM] INPUT... [-- OPTIONS OF BUILD...]

  --parts N          a power of two, at most 4096
  --jobs N           processes at a time; all cores if not given
  --folder DIR       where parts are kept; OUT.mt.parts if not given
  --command PROGRAM  the program; tetralod if not given
END
    exit 2
}

fail() {
    echo "build-in-parts.sh: $1" >&2
    exit "${2:-2}"
}

parts='' output='' folder='' program=tetralod jobs=$(getconf _NPROCESSORS_ONLN 2>/dev/null || echo 1)
inputs=0
# What `part` gets stays in "$@", in its order: each argument is dropped, or goes to the end of the list.
count=$#
while [ "$count" -gt 0 ]; do
    case $1 in
        --)
            shift
            while [ "$((count -= 1))" -gt 0 ]; do
                set -- "$@" "$1"
                shift
            done
            ;;
        --parts | --jobs | --folder | --command | -o)
            [ "$count" -ge 2 ] || usage
            case $1 in
                --parts) parts=$2 ;;
                --jobs) jobs=$2 ;;
                --folder) folder=$2 ;;
                --command) program=$2 ;;
                -o) output=$2 ;;
            esac
            shift 2
            count=$((count - 2))
            ;;
        -*) usage ;;
        *)
            inputs=$((inputs + 1))
            set -- "$@" "$1"
            shift
            count=$((count - 1))
            ;;
    esac
done
[ "$inputs" -gt 0 ] && [ -n "$parts" ] && [ -n "$output" ] || usage
case $parts$jobs in *[!0-9]*) usage ;; esac
folder=${folder:-$output.parts}
plan=$folder/plan.json

# Which of the files $2-0.part, $2-1.part, ... are missing, of $1: a number a line.
missing() {
    node=0
    while [ "$node" -lt "$1" ]; do
        [ -e "$folder/$2-$node.part" ] || echo "$node"
        node=$((node + 1))
    done
}

# Makes what is missing of the $1 files of level $2 by the command that follows, in which %NUMBER% stands for the number of each.
make_level() {
    count=$1 level=$2
    shift 2
    numbers=$(missing "$count" "built-$level")
    [ -n "$numbers" ] || return 0
    echo "level $level: $(echo "$numbers" | wc -l) of $count, $jobs at a time" >&2
    echo "$numbers" | xargs -P "$jobs" -I %NUMBER% "$program" "$@" --quiet ||
        fail "level $level is not complete: give the same command again to go on" 1
}

# What is in the folder must have been made of the same arguments.
arguments=$(printf '%s\n' "$parts" "$@")
if [ -e "$plan" ] && [ "$(cat "$folder/arguments.txt")" != "$arguments" ]; then
    fail "$folder was made of another input or with other options: give another --folder, or remove it"
fi
if [ ! -e "$plan" ] || [ -n "$(missing "$parts" input)" ]; then
    echo "parting into $parts parts" >&2
    mkdir -p "$folder"
    printf '%s\n' "$arguments" > "$folder/arguments.txt"
    "$program" part "$@" --parts "$parts" -o "$folder" --quiet
fi

make_level "$parts" 0 build "$folder" --part "%NUMBER%/$parts" --threads 1
level=0 count=$parts
while [ "$count" -gt 1 ]; do
    level=$((level + 1)) count=$(((count + 7) / 8))
    make_level "$count" "$level" join "$folder" --node "$level/%NUMBER%"
done

[ -e "$output" ] || "$program" join "$folder" -o "$output"
