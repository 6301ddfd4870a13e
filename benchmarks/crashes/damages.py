def size(lab, asked): return 0
def case(lab, number): raise NotImplementedError
