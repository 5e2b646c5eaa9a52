#!/usr/bin/env python3
"""Reads the model files by an independent YAML parser and validates them against the JSON schema.

    .ci/models.py            models/*.yaml and the model files in README.md and docs/

PyYAML follows YAML 1.1, the program YAML 1.2: a number such as `1e-10` is text in 1.1, which the schema
refuses, so this holds the model files to spellings that both read alike.
"""
import json
import pathlib
import re
import sys

try:
    import jsonschema
    import yaml
except ImportError as error:
    print(f"SKIPPED: {error} (pip install pyyaml jsonschema)")
    sys.exit(0)

root = pathlib.Path(__file__).resolve().parent.parent
schema = json.loads((root / "docs/kmcfit.schema.json").read_text())
validator_of = jsonschema.validators.validator_for(schema)
validator_of.check_schema(schema)
validator = validator_of(schema)

texts = {str(path.relative_to(root)): path.read_text() for path in sorted(root.glob("models/*.yaml"))}
for page in [root / "README.md", *sorted(root.glob("docs/*.md"))]:
    blocks = re.findall(r"^```yaml\n(.*?)^```$", page.read_text(), re.S | re.M)
    for number, block in enumerate(blocks, 1):
        if block.lstrip().startswith(("format:", "# yaml-language-server")):
            texts[f"{page.relative_to(root)}, block {number}"] = block

wrong = 0
for name, text in texts.items():
    for error in sorted(validator.iter_errors(yaml.safe_load(text)), key=lambda error: list(error.path)):
        place = ".".join(map(str, error.path)) or "the whole"
        print(f"{name}: {place}: {error.message[:200]}")
        wrong += 1
print(f"{len(texts)} model files, {wrong} mistakes")
sys.exit(wrong > 0)
