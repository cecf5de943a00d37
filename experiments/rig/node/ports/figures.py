#!/usr/bin/env python3
"""Size of code, RAM and worst-case stack of a node's image.

    figures.py --elf IMAGE --objects OBJECT... --prefix arm-none-eabi- --out FILE.json

The stack is the heaviest path through the call graph that GCC writes beside each object (-fcallgraph-info=su), from where the
processor begins, and on top of it an exception's frame and the heaviest path of a handler. A call through a table of virtual
functions may lead to every virtual function of the image. Recursion and frames without a bound are refused; functions that GCC
did not compile now (of libgcc) are read from their instructions.
"""
import argparse
import json
import re
import subprocess
import sys

NODE = re.compile(r'node: \{ title: "([^"]+)" label: "([^"]*)"')
EDGE = re.compile(r'edge: \{ sourcename: "([^"]+)" targetname: "([^"]+)"')
FRAME = re.compile(r'(\d+) bytes \(([a-z,]+)\)$')
INDIRECT = '__indirect_call'
EXCEPTION_FRAME = 32 + 4  # eight registers, and what aligns them (Arm DDI 0403, B1.5.6)
MOST_NAMED = 12


class Refused(Exception):
    """What has no bound."""


def call_graph(paths):
    """The frames of functions, whom they call, and which are virtual."""
    frames, calls, virtual = {}, {}, set()
    for path in paths:
        with open(path, encoding='utf-8') as text:
            for line in text:
                if node := NODE.match(line):
                    name, label = node.groups()
                    frame = FRAME.search(label)
                    if not frame:
                        continue
                    if frame[2] not in ('static', 'dynamic,bounded'):
                        raise Refused(f'{name}: its frame has no bound ({frame[2]})')
                    frames[name] = max(int(frame[1]), frames.get(name, 0))
                    if label.startswith('virtual '):
                        virtual.add(name)
                elif edge := EDGE.match(line):
                    calls.setdefault(edge[1], set()).add(edge[2])
    return frames, calls, virtual


def from_instructions(elf, objdump):
    """The same of every function of the image, from what it pushes and where it branches."""
    listing = subprocess.run([objdump, '-d', '--no-show-raw-insn', elf], check=True, capture_output=True, text=True).stdout
    frames, calls, name = {}, {}, None
    for line in listing.splitlines():
        if begin := re.match(r'[0-9a-f]+ <([^>]+)>:', line):
            name = begin[1]
            frames[name], calls[name] = 0, set()
        elif name:
            if pushed := re.search(r'\b(?:push|stmdb\s+sp!,)\S*\s*\{([^}]*)\}', line):
                for part in pushed[1].split(','):
                    ends = re.findall(r'\d+', part) if '-' in part else ()
                    frames[name] += 4 * (int(ends[1]) - int(ends[0]) + 1 if ends else 1)
            elif below := re.search(r'\bsub(?:w|\.w)?\s+sp,(?:\s*sp,)?\s*#(\d+)', line):
                frames[name] += int(below[1])
            elif before := re.search(r'\[sp, #-(\d+)\]!', line):
                frames[name] += int(before[1])
            if to := re.search(r'\bbl?(?:\.w)?\s+[0-9a-f]+ <([^>+]+)>', line):
                calls[name].add(to[1])
    for name, targets in calls.items():
        targets.discard(name)  # a branch to its own beginning is a loop
    return frames, calls


def heaviest(start, frames, calls, virtual, known):
    """The heaviest path from a function, and its bytes."""
    listed_frames, listed_calls = known
    done, doing = {}, []

    def visit(name):
        if name in done:
            return done[name]
        if name in doing:
            raise Refused('recursion: ' + ' -> '.join(doing[doing.index(name):] + [name]))
        if name not in frames and name not in listed_frames and name != INDIRECT:
            raise Refused(f'{name}: nothing is known of its stack')
        doing.append(name)
        if name == INDIRECT:
            frame, targets = 0, virtual
        elif name in frames:
            frame, targets = frames[name], calls.get(name, ())
        else:
            frame, targets = listed_frames[name], listed_calls[name]
        below = max((visit(target) for target in sorted(targets)), default=(0, []))
        doing.pop()
        done[name] = (frame + below[0], [name] + below[1])
        return done[name]

    return visit(start)


def section_sizes(elf, size):
    lines = subprocess.run([size, '-A', elf], check=True, capture_output=True, text=True).stdout.splitlines()
    return {fields[0]: int(fields[1]) for fields in (line.split() for line in lines) if len(fields) == 3 and fields[1].isdigit()}


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--elf', required=True)
    parser.add_argument('--objects', nargs='+', required=True)
    parser.add_argument('--prefix', default='arm-none-eabi-')
    parser.add_argument('--start', default='start')
    parser.add_argument('--handlers', nargs='*', default=['on_watchdog', 'on_fault'])
    parser.add_argument('--out', required=True)
    chosen = parser.parse_args()
    frames, calls, virtual = call_graph(re.sub(r'\.o$', '.ci', path) for path in chosen.objects)
    known = from_instructions(chosen.elf, chosen.prefix + 'objdump')
    path = heaviest(chosen.start, frames, calls, virtual, known)
    handler = max(heaviest(name, frames, calls, virtual, known) for name in chosen.handlers)
    worst = path[0] + EXCEPTION_FRAME + handler[0]
    sizes = section_sizes(chosen.elf, chosen.prefix + 'size')
    code, data, bss, room = (sizes.get(name, 0) for name in ('.text', '.data', '.bss', '.stack'))
    if worst > room:
        raise Refused(f'the stack may need {worst} bytes, and has {room}')
    names = subprocess.run([chosen.prefix + 'c++filt', '-p'], input='\n'.join(path[1]), check=True, capture_output=True,
                           text=True).stdout.split('\n')
    with open(chosen.out, 'w', encoding='utf-8') as out:
        json.dump({'code_bytes': code, 'data_bytes': data, 'bss_bytes': bss, 'stack_room_bytes': room,
                   'worst_stack_bytes': worst, 'worst_path': names}, out, indent=1)
        out.write('\n')
    print(f'node image: code {code + data} bytes (.text {code}, .data {data}), RAM {data + bss} bytes (.data, .bss {bss}) and '
          f'a stack of {room}, of which at most {worst} are used: ' + ' > '.join(names[:MOST_NAMED]))


if __name__ == '__main__':
    try:
        main()
    except Refused as problem:
        sys.exit(f'figures.py: {problem}')
