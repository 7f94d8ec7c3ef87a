"""Opcodes: the numbers of the instructions that are read (SPIR-V Specification 1.6, section 3.49).

glslangValidator makes no other instruction from GLSL 3.30, without subgroups, atomics and geometry stages.
"""

from __future__ import annotations

from glshade.spirv.module import Kind, StageName, Storage

# Instructions that say something about the module.
ABOUT_THE_MODULE = {
    5: "Name",
    6: "MemberName",
    8: "Line",
    11: "ExtInstImport",
    15: "EntryPoint",
    317: "NoLine",
}
# Instructions that declare a type, and its kind.
TYPES: dict[int, Kind] = {
    19: "void",
    20: "bool",
    21: "int",
    22: "float",
    23: "vector",
    24: "matrix",
    25: "image",
    27: "sampled image",
    28: "array",
    30: "struct",
    32: "pointer",
    33: "function",
}
# Instructions that declare a constant: True, False, Constant, ConstantComposite, ConstantNull and Undef.
CONSTANTS = {41: "true", 42: "false", 43: "number", 44: "composite", 46: "zero", 1: "undefined"}
# Instructions that make up functions.
OF_FUNCTIONS = {54: "Function", 55: "FunctionParameter", 56: "FunctionEnd", 59: "Variable", 248: "Label"}
# Instructions that change no value: Nop, SourceContinued, Source, SourceExtension, String, Extension, MemoryModel,
# ExecutionMode, Capability, Decorate, MemberDecorate, LoopMerge, SelectionMerge and ModuleProcessed. Built-ins are known by
# their names, not by their decorations.
WITHOUT_EFFECT = frozenset({0, 2, 3, 4, 7, 10, 14, 16, 17, 71, 72, 246, 247, 330})
# Instructions of functions whose first two words are the type and the id of the result.
WITH_RESULT = {
    12: "ExtInst",
    57: "FunctionCall",
    61: "Load",
    65: "AccessChain",
    66: "AccessChain",  # InBoundsAccessChain
    77: "VectorExtractDynamic",
    79: "VectorShuffle",
    80: "CompositeConstruct",
    81: "CompositeExtract",
    84: "Transpose",
    87: "ImageSampleImplicitLod",
    88: "ImageSampleExplicitLod",
    91: "ImageSampleProjImplicitLod",
    92: "ImageSampleProjExplicitLod",
    95: "ImageFetch",
    100: "Image",
    103: "ImageQuerySizeLod",
    109: "ConvertFToU",
    110: "ConvertFToS",
    111: "ConvertSToF",
    112: "ConvertUToF",
    124: "Bitcast",
    126: "SNegate",
    127: "FNegate",
    128: "IAdd",
    129: "FAdd",
    130: "ISub",
    131: "FSub",
    132: "IMul",
    133: "FMul",
    134: "UDiv",
    135: "SDiv",
    136: "FDiv",
    137: "UMod",
    139: "SMod",
    141: "FMod",
    142: "VectorTimesScalar",
    143: "MatrixTimesScalar",
    144: "VectorTimesMatrix",
    145: "MatrixTimesVector",
    146: "MatrixTimesMatrix",
    147: "OuterProduct",
    148: "Dot",
    154: "Any",
    155: "All",
    156: "IsNan",
    157: "IsInf",
    164: "LogicalEqual",
    165: "LogicalNotEqual",
    166: "LogicalOr",
    167: "LogicalAnd",
    168: "LogicalNot",
    169: "Select",
    170: "IEqual",
    171: "INotEqual",
    172: "UGreaterThan",
    173: "SGreaterThan",
    174: "UGreaterThanEqual",
    175: "SGreaterThanEqual",
    176: "ULessThan",
    177: "SLessThan",
    178: "ULessThanEqual",
    179: "SLessThanEqual",
    180: "FOrdEqual",
    182: "FOrdNotEqual",
    183: "FUnordNotEqual",
    184: "FOrdLessThan",
    186: "FOrdGreaterThan",
    188: "FOrdLessThanEqual",
    190: "FOrdGreaterThanEqual",
    194: "ShiftRightLogical",
    195: "ShiftRightArithmetic",
    196: "ShiftLeftLogical",
    197: "BitwiseOr",
    198: "BitwiseXor",
    199: "BitwiseAnd",
    200: "Not",
    207: "DPdx",
    208: "DPdy",
    209: "Fwidth",
    210: "DPdx",  # DPdxFine
    211: "DPdy",
    212: "Fwidth",
    213: "DPdx",  # DPdxCoarse
    214: "DPdy",
    215: "Fwidth",
    245: "Phi",
}
# Instructions of functions without a result.
WITHOUT_RESULT = {62: "Store"}
# The last instruction of a block.
TERMINATORS = {
    249: "Branch",
    250: "BranchConditional",
    251: "Switch",
    252: "Kill",
    253: "Return",
    254: "ReturnValue",
    255: "Unreachable",
}
# The storage classes (section 3.7).
STORAGES: dict[int, Storage] = {0: "uniform", 1: "in", 2: "block", 3: "out", 6: "private", 7: "function"}
# The execution models that can be run (section 3.3).
STAGES: dict[int, StageName] = {0: "vertex", 4: "fragment"}
